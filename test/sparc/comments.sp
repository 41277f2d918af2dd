% nothing. sorts
sorts % here
#s = {a}. % p(b).
predicates p(#s).
rules p(a). % the end
%= p(a)
