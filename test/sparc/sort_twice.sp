sorts
#a = {x}.
#a = {y}.
predicates
p(#a).
rules
p(x).
%! 3:1: sort '#a' is defined already, at FILE:2:1
