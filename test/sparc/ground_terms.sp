sorts
#s = {a, 7, f(b, g(c, 1)), f(d)}.
predicates
p(#s).
rules
p(X).
%= p(7) p(a) p(f(d)) p(f(b,g(c,1)))
