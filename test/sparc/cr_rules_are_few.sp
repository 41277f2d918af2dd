predicates
a(). b(). c(). ok().
rules
a:+. b:+. c:+. ok :- b, c. :- not a, not ok.
%= a
