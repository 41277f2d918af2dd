sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(X) :- h(onn(X, X), 1).
%! 7:11: no sort has a record 'onn'; did you mean 'on'?
