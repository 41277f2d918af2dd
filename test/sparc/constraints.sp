sorts
#s = 1..3.
predicates
p(#s).
rules
{p(X) : #s(X)}.
:- p(X), p(X + 1).
:- not p(1).
%= p(1)
%= p(1) p(3)
