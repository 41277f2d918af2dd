sorts
#a = {x}.
predicates
p(#a). p(#a, #a).
rules
%! 4:8: predicate 'p' is declared already, at FILE:4:1
