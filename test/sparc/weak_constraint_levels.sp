predicates
a(). b().
rules
a | b.
:~ a. [1:2]
:~ b. [9:]
display
a. b.
%= b
