sorts
#s = 0..1.
#z = {z}.
predicates
p(#s). q(#z).
rules
p(0).
q(z) :- p(X + 1).
%= p(0)
