#const n = 3.
sorts
#s = 1..5.
predicates
p(#s).
rules
p(2..n).
%= p(2) p(3)
