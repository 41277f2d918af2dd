sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(duck, cube) :- q(1).
%! 7:1: found 2 arguments of 'p', expected 1: p(#a)
