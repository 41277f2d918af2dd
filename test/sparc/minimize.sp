sorts
#s = 1..3.
predicates
p(#s).
rules
1{p(X) : #s(X)}.
:- p(1).
#minimize{X, X : p(X)}.
%= p(2)
