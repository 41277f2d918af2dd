sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(duk). q(4).
%! 7:3: 'duk' in p(duk) does not belong to sort '#a' ('duck' and 'cube'); did you mean 'duck'?
%! 7:11: '4' in q(4) does not belong to sort '#n' (1..3)
