sorts
#a = {x, y}. #n = 1..2.
predicates
in(#a, #n).
rules
1{in(A, N) : #n(N)}1 :- #a(A).
:- in(x, N), in(y, N).
%= in(x,1) in(y,2)
%= in(x,2) in(y,1)
