sorts
#s = 2..4.
predicates
p(#s).
rules
p(X).
%= p(2) p(3) p(4)
