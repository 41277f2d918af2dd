sorts
#s = 1..2.
#f = f(#s(X), #s(Y), #s(Z)) : (X = Y or Y = Z) and X != Z.
predicates
p(#f).
rules
p(X).
%= p(f(1,1,2)) p(f(1,2,2)) p(f(2,1,1)) p(f(2,2,1))
