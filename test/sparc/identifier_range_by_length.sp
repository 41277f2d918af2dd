sorts
#s = a0..b1.
#t = #s * {a0, a9, aA, az, b0, b1, b2, a, c0}.
predicates
p(#t).
rules
p(X).
%= p(a0) p(a9) p(aA) p(az) p(b0) p(b1)
