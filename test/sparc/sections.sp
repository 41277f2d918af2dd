predicates
p().
sorts
#a = {x}.
rules
p.
%! 4:1: section 'sorts' stands after 'predicates', expected before it
