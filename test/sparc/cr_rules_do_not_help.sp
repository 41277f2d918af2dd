predicates
a(). b().
rules
a :+.
:- not b.
%= none
