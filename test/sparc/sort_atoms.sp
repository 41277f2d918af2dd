sorts
#a = {x, y, z}. #b = {y, w}.
predicates
p(#a). q(#a).
rules
p(X) :- #b(X).
q(X) :- not #b(X), #a(X).
%= p(y) q(x) q(z)
