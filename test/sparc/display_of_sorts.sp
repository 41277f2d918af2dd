sorts
#s = {a, f(b)}. #t = 1..2.
predicates
p(#s).
rules
p(a).
display
#s(f(X)). #t.
%= #s(f(b)) #t(1) #t(2)
