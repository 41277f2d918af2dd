sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(duck)
%! 7:1: this statement is not ended by a full stop, '.'
