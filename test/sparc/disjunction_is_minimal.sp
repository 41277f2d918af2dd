predicates
a(). b().
rules
a | b. a :- b. b :- a.
%= a b
