sorts
#a = 3..1. #b = zbc..cbz. #c = abc..a.
predicates
p(#a).
rules
%! 2:6: range 3..1 is upside down, expected 1..3
%! 2:17: range zbc..cbz is upside down: 'cbz' comes before 'zbc'
%! 2:32: range abc..a is upside down: 'abc' is longer than 'a'
