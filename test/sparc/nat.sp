#maxint = 4.
sorts
#even = {0, 2, 4}.
predicates
half(#even, #nat).
rules
half(X, X / 2).
%= half(0,0) half(2,1) half(4,2)
