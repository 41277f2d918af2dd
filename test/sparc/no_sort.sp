sorts
#block = {x}.
#thing = #blok + {y}.
predicates
p(#things).
rules
%! 3:10: sort '#blok' is not defined; did you mean '#block'?
%! 5:3: sort '#things' is not defined; did you mean '#thing'?
