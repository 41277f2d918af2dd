sorts
#s = {a, b}.
predicates
p(#s). q().
rules
p(a). -p(b). q.
%= p(a) q -p(b)
