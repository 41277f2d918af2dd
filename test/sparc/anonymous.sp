sorts
#s = {a, b}.
predicates
p(#s, #s). q(#s). r(#s). t(#s).
rules
p(a, b). -p(b, b).
q(X) :- p(X, _).
r(X) :- not p(X, _).
t(X) :- not -p(X, _).
%= p(a,b) -p(b,b) q(a) r(b) t(a)
