sorts
#a = f(#b).
#b = #a + {x}.
predicates
p(#b).
rules
%! 2:1: sort '#a' is defined by itself; expected other sorts
