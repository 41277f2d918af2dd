sorts
#k = {a, b}.
#s = [book][1..2].
#t = [#k][x, y][0].
#u = [1..2][0].
predicates
p(#s). q(#t). r(#u).
rules
p(X). q(X) :- X != bx0. r(X).
%= p(book1) p(book2) q(ax0) q(ay0) q(by0) r(10) r(20)
