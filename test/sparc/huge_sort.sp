#maxint = 10000000.
sorts
#a = 1..10000000.
predicates
p(#a).
rules
p(X).
%! 3:1: sort '#a' has up to 10000000 members, expected at most 1000000
