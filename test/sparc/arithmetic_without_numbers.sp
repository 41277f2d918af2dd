sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(X + 1) :- q(X).
h(on(X * 2, duck), 1) :- q(X).
%! 7:3: found X + 1 in p(X + 1), but sort '#a' has no numbers
%! 8:6: found X * 2 in h(on(X * 2, duck), 1), but sort '#a' has no numbers
