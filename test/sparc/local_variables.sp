sorts
#s = 1..3. #few = 2..5.
predicates
p(#s). q(#few). all().
rules
p(1..3).
all :- #count{X : p(X), not q(X)} = 2.
%= p(1) p(2) p(3) all
