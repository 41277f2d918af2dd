sorts
#a = {duck, cube}. #n = 1..3.
#r = on(#a, #a).
predicates
p(#a). q(#n). h(#r, #n).
rules
p(duck :- q(1).
p(cube.
q(1) q(2).
%! 7:8: found ':-', expected
%! 8:7: found the end of the statement, expected
%! 9:6: found 'q', expected
