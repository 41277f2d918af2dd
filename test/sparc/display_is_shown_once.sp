predicates
a(). b().
rules
a. {b}.
display
a.
%= a
