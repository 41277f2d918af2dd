sorts
#a = {x}.
#b = #a - {x}.
predicates
p(#b).
rules
%! 3:1: sort '#b' is empty; expected at least one member
