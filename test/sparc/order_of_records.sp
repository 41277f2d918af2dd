sorts
#a = f(#nat). #b = g(#a(X), #a(Y)) : X < Y.
predicates
p(#b).
rules
%! 2:38: '<' compares X, whose sort '#a' has records; expected numbers or names
