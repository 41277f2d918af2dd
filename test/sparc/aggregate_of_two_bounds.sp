sorts
#s = 1..3.
predicates
p(#s).
rules
{p(X) : #s(X)}.
:- 3 <= #sum{X : p(X)} <= 5.
:- #count{X : p(X)} < 1.
%= p(1)
%= p(2)
%= p(1) p(2) p(3)
