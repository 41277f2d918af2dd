sorts
#a = {x}.
#b = f(#a(X), #a(X)) : X != X.
predicates
p(#b).
rules
%! 3:18: X occurs twice in a record; expected two variables
