sorts
#a = {x, y}. #n = 1..2.
#r = at(#a, #n).
predicates
p(#r).
rules
p(at(x, N)).
%= p(at(x,1)) p(at(x,2))
