sorts
#a = {x}.
#s = f(#a) + g(#a, #a) + {h(x), z}.
predicates
p(#s).
rules
p(X) :- X != z.
%= p(f(x)) p(h(x)) p(g(x,x))
