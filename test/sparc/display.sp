sorts
#s = {a, b, f(a), f(b)}.
predicates
p(#s). q().
rules
-q. p(a). -p(b). p(f(a)). -p(f(b)).
display
-q. -p(f(X)). p(X).
%= -q -p(f(b)) p(a) p(f(a))
