sorts
#s = {a}.
predicates
p(#s). q(#s).
rules
p(a) :- not q(a).
-p(a).
q(a) :+.
%= -p(a) q(a)
