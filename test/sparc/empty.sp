%! 1:1: found no statement; expected sorts, predicates, rules
