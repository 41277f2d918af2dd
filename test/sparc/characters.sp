sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p("duck").
q(1) ? q(2).
%! 7:3: found '"', expected no quotes: SPARC has no strings
%! 8:6: found the character '?'
