sorts
#s = {0, 1, 2}. #all = 0..9.
predicates
p(#s). q(#all).
rules
1{p(X)}1 :- X < 2.
:- p(2).
%= p(0) p(1)
