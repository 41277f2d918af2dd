sorts
#s = {a, b}.
predicates
p(#s).
rules
{p(a); p(b)}.
:- p(a), p(b).
%= 
%= p(a)
%= p(b)
