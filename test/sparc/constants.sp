#const n = 2. #const m = n.
sorts
#s = 1..m.
predicates
p(#s).
rules
p(n).
p(X) :- p(X + 1).
%= p(1) p(2)
