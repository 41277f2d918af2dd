sorts
#s = 1..3.
predicates
p(#s). q().
rules
q.
2 <= {p(X) : X != 2; p(2)} < 1 + 2 :- q.
%= q p(1) p(2)
%= q p(1) p(3)
%= q p(2) p(3)
