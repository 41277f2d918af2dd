sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(X) :- h(on(X), 1).
%! 7:11: found 1 arguments of record 'on', expected 2
