sorts
#s = {a, b}.
predicates
fly(#s). bird(#s).
rules
bird(X).
-fly(a).
fly(X) :- bird(X), not -fly(X).
%= bird(a) bird(b) fly(b) -fly(a)
