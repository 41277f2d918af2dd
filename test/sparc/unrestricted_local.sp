sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(X) :- #count{Q : Q < 3, p(X)} > 1.
%! 7:16: the local variable Q is unrestricted; expected it in an atom of the same element, such as '#r(Q)'
