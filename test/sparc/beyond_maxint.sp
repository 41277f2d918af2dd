sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
q(X) :- q(X), X < 3000.
%! 7:19: found the number 3000, expected at most 2000 ('#maxint'); '#maxint = 3000.' at the beginning allows it
