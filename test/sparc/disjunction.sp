sorts
#s = {a, b}.
predicates
p(#s). q().
rules
p(a) | p(b) | -q.
:- -q.
%= p(a)
%= p(b)
