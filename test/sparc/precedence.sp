sorts
#s = 0..30.
predicates
p(#s).
rules
p(X) :- X = 20 - 2 * 3 - 4 / 2 - 1.
%= p(11)
