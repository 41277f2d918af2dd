"""From the solver's symbols to atoms and literals of a domain."""

from __future__ import annotations

import clingo

from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.terms import Constant, Number, Record, Symbol


def atom_of(symbol: clingo.Symbol) -> Atom:
    """The atom that a symbol such as `pickup(robot,red_can)` stands for."""
    return Atom(symbol.name, tuple(map(term_of, symbol.arguments)))


def literal_of(symbol: clingo.Symbol, negation: str) -> Literal:
    """The literal that a symbol stands for.

    Args:
        symbol: An atom, or `negation(atom)`.
        negation: Name of the function that says "not".
    """
    if symbol.name == negation:
        return Literal(atom_of(symbol.arguments[0]), False)
    return Literal(atom_of(symbol))


def term_of(symbol: clingo.Symbol) -> Symbol:
    """The term that a symbol stands for."""
    if symbol.type is clingo.SymbolType.Number:
        return Number(symbol.number)
    if symbol.arguments:
        return Record(symbol.name, tuple(map(term_of, symbol.arguments)))
    return Constant(symbol.name)
