sorts
#o = {a, b}. #l = loc(#o, #o). #t = 0..1.
predicates
holds(#l, #t).
rules
holds(loc(a, X), T) :- X != a. holds(loc(b, a), 1). holds(loc(X, X), 0).
display
holds(loc(X, a), T). holds(loc(_, b), 1).
%= holds(loc(a,a),0) holds(loc(b,a),1) holds(loc(a,b),1)
