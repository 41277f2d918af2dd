sorts
#s = a..d.
predicates
p(#s).
rules
p(X) :- X != b.
%= p(a) p(c) p(d)
