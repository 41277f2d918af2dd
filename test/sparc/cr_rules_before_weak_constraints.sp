predicates
a(). b(). c().
rules
a :+. b :+. c :+.
:- not a, not b.
:- b, not c.
:~ a. [9:9]
%= a
