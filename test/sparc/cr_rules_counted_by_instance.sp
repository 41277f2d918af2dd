sorts
#s = {x, y, z}.
predicates
p(#s). q(#s). r().
rules
q(x). q(y).
r0: p(X) :+ q(X).
r1: r :+.
:- not p(x), not r.
:- not p(y), not r.
%= q(x) q(y) r
