sorts
#s = 0..2.
predicates
p(#s). q(#s).
rules
p(X).
q(X + 1) :- p(X), not p(X + 2).
%= p(0) p(1) p(2)
