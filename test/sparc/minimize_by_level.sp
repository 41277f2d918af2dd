sorts
#s = 1..2.
predicates
p(#s). q(#s).
rules
1{p(X) : #s(X)}1. 1{q(X) : #s(X)}1.
#minimize{X@1 : q(X)}.
#minimize{3 - X@2, X : p(X); 5@1 : p(2), q(1)}.
%= p(2) q(2)
