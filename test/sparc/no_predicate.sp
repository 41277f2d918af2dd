sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
pp(duck).
%! 7:1: predicate 'pp' is not declared; did you mean 'p'?
