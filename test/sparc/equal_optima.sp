predicates
a(). b(). c().
rules
a | b. {c}.
:~ c.
%= a
%= b
