sorts
#a = #b + {x}.
#b = {y}.
predicates
p(#a).
rules
p(X) :- #b(X).
%= p(y)
