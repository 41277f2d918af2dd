sorts
#n = 1..3.
#r = r(#n(X), #n(Y)) : X < Y and not(X = Y) or X > Y and Y >= X.
predicates
p(#r).
rules
p(X).
%= p(r(1,2)) p(r(1,3)) p(r(2,3))
