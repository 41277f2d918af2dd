#maxint = 100.
predicates
p(#nat).
rules
p(X) :- X * X * X + 6 * X * X + 12 * X + 8 = 64.
%= p(2)
