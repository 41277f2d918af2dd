#const n = 5. #const m = nn.
sorts
#a = 1..k.
predicates
p(#a).
rules
p(X + k) :- p(X).
%! 1:26: 'nn' is no constant; expected a number or a constant defined before
%! 3:6: 'k' in range 1..k is no constant, expected a number
%! 7:7: found 'k' in arithmetic, expected a number: it is no constant
