#maxint = 9.
sorts
#s = 1..3.
predicates
p(#s). q(#nat).
rules
p(1..2).
q(X) :- p(X + 1).
%= p(1) p(2) q(0) q(1)
