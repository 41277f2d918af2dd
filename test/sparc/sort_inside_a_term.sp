sorts
#a = {x}.
#r = f(#a).
predicates
p(#r).
rules
p(f(#a)).
p(X) :- p(X), X != #r.
%! 7:5: found '#a', expected a term
%! 8:20: found '#r', expected a term
