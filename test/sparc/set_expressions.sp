sorts
#a = {1, 2, 3, 4}.
#b = {3, 4, 5} + #a * {1, 9} - {4}.
#c = ({3, 4, 5} + #a) * {1, 9, 5}.
predicates
p(#b). q(#c).
rules
p(X). q(X).
%= p(1) p(3) p(5) q(1) q(5)
