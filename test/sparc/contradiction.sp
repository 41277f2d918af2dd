predicates
p().
rules
p. -p.
%= none
