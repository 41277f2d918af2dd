sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
r: p(duck) :+.
r: p(cube) :+.
%! 8:1: label 'r' is used already, at FILE:7:1
