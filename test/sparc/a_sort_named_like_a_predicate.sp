sorts
#s = {a, b}.
predicates
s(#s). t(#s).
rules
s(a). t(X) :- #s(X), not s(X).
%= s(a) t(b)
