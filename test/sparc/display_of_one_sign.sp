sorts
#s = {a, b}.
predicates
p(#s).
rules
p(a). -p(b).
display
p.
%= p(a)
