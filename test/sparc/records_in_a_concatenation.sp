sorts
#a = {f(x)}.
#b = [a][#a].
predicates
p(#b).
rules
%! 3:10: sort '#a' has records; expected a basic sort in a concatenation
