sorts
#s = 1..3. #c = 0..9.
predicates
p(#s). s(#c). l(#c). h(#c).
rules
p(2). p(3).
s(N) :- N = #sum{X : p(X)}.
l(N) :- N = #min{X : p(X)}.
h(N) :- N = #max{X : p(X), X < 3}.
%= p(2) p(3) s(5) l(2) h(2)
