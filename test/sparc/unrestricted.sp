sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(X) :- Y < 3.
%! 7:9: the variable Y is unrestricted; expected it in an atom, such as '#r(Y)'
