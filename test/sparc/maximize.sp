sorts
#s = 1..3.
predicates
p(#s).
rules
{p(X)} 2 :- #s(X).
:- p(2).
#maximize{1, X : p(X)}.
%= p(1) p(3)
