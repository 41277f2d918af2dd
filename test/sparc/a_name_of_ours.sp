predicates
applied(). restore(). known(). weak().
rules
applied :+. restore | known.
:- not applied.
:~ known.
%= applied restore
