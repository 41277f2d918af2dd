sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
#a(duck).
%! 7:1: sort '#a' stands in a head, expected a predicate
