sorts
#s = 1..3. #c = 0..9.
predicates
p(#s). n(#c). big().
rules
p(1). p(3).
n(N) :- N = #count{X : p(X)}.
big :- #count{X, 1 : p(X); X, 2 : #s(X), not p(X)} >= 3.
%= p(1) p(3) n(2) big
