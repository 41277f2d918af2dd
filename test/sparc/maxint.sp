#maxint = 3.
predicates
p(#nat).
rules
p(0). p(X + 1) :- p(X).
%= p(0) p(1) p(2) p(3)
