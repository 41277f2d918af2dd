predicates
a(). b(). c().
rules
a. -a :- not b, not c. b :+. c :+. b :- c. c :- b.
%= a b c
