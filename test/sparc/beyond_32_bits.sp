#maxint = 100000.
predicates
p(#nat).
rules
p(X) :- X * X = 4.
%! 5:9: X * X may be as large as 10000000000, expected at most 2147483647
