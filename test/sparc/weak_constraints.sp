sorts
#s = {a, b, c}.
predicates
p(#s). q().
rules
p(a). p(b). p(c) | q.
:~ p(X). [1:1]
:~ q. [2:1]
%= p(a) p(b) p(c)
