"""SPARC programs: a sorted language over CR-Prolog, read and translated to clingo's text.

`language.load` reads and checks a program, `translation.translated` turns it into a logic program.
Nothing here solves anything (paper, section on ASP; docs/sparc.md).
"""
