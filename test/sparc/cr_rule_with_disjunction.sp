predicates
a(). b(). c().
rules
r: a | b :+ not c.
:- not a, not b.
%= a
%= b
