#maxint = 9.
sorts
#s = {0, 4, 9}.
predicates
p(#s).
rules
p(X * X).
%= p(0) p(4) p(9)
