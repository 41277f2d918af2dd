sorts
#s = 0..20.
predicates
p(#s). q(#s).
rules
q(3).
p(X * X - (X + 1) / 2) :- q(X).
%= p(7) q(3)
