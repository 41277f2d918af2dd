predicates
a(). b().
rules
a :+.
b :- not a.
%= b
