"""Knowledge as data: sorts, signature, axioms, histories; its languages; its logic programs.

`terms`, `literals`, `signature`, `axioms` and `description` are the data model that every front end
produces and every translation reads. `sorting` says which sorts guard a variable, `rendering` turns
literals into clingo's text. Nothing here solves anything.
"""
