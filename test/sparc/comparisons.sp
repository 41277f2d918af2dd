sorts
#s = 1..3.
predicates
p(#s, #s).
rules
p(X, Y) :- X <= Y, X != Y, Y >= 2, X < 3, X == 1, Y > 2.
%= p(1,3)
