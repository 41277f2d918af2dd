"""What the statements of a logic program speak of, read from clingo's syntax tree.

Heads and bodies as predicates tell which rules bear on the answer and which facts they need.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from clingo import ast

Signature = tuple[str, int]
"""Name and number of arguments of a predicate."""

CONCLUSIONS = frozenset({("pos", 1), ("neg", 1), ("pos", 2), ("neg", 2)})
"""The predicates that say what the program concludes of a fluent."""


_ABOUT_ATOMS = ("possible", "unknown")


@dataclass(frozen=True, eq=False)
class Statement:
    """A statement of a program.

    Attributes:
        node: Its syntax tree.
        heads: Predicates that it defines; empty for everything that is not a rule with a head.
        bodies: Predicates that it needs.
        denied: Predicates of classically negated literals in its body.
        unknown: Predicates about whose being unknown it asks, `unknown(above(A, B))`.
        axiom: Id of the axiom that it says; None for what is always there.
    """

    node: ast.AST
    heads: frozenset[Signature] = frozenset()
    bodies: frozenset[Signature] = frozenset()
    denied: frozenset[Signature] = frozenset()
    unknown: frozenset[str] = frozenset()
    axiom: str | None = None

    @classmethod
    def of(cls, node: ast.AST, axiom: str | None = None) -> Statement:
        """Reads a syntax tree."""
        if node.ast_type == ast.ASTType.Defined:
            return cls(node, heads=frozenset({(str(node.name), int(node.arity))}), axiom=axiom)
        if node.ast_type == ast.ASTType.ShowSignature:
            return cls(node, bodies=frozenset({(str(node.name), int(node.arity))}), axiom=axiom)
        if node.ast_type != ast.ASTType.Rule:
            return cls(node, bodies=_signatures(_atoms([node])), axiom=axiom)
        head, body = _atoms([node.head]), _atoms(node.body)
        # A choice or an aggregate in the head also holds conditions.
        plain = node.head.ast_type == ast.ASTType.Literal
        return cls(
            node,
            heads=_signatures(head),
            bodies=_signatures(body if plain else head + body),
            denied=_signatures(atom for atom in body if atom.denied),
            unknown=frozenset(
                str(atom.arguments[0].name) for atom in body if atom.name == "unknown"
            ),
            axiom=axiom,
        )


def relevant(statements: Iterable[Statement]) -> tuple[Statement, ...]:
    """The statements that bear on conclusions, on what is shown, or on constraints.

    Leaving out the others, such as converses of relations that no axiom uses, keeps grounding
    small: their number grows with the square of the number of objects.
    """
    statements = tuple(statements)
    needed = set(CONCLUSIONS)
    kept: set[int] = set()
    while True:
        reached = {
            index
            for index, statement in enumerate(statements)
            if not statement.heads or statement.heads & needed
        }
        if reached == kept:
            return tuple(statements[index] for index in sorted(kept))
        kept = reached
        for index in kept:
            needed |= statements[index].bodies


@dataclass(frozen=True, eq=False)
class _Predicate:
    """A predicate with its arguments, perhaps classically negated."""

    name: str
    arguments: Sequence[ast.AST]
    denied: bool

    @property
    def signature(self) -> Signature:
        """Name and arity; `possible(above(A, B))` counts as a predicate of its own."""
        if self.name in _ABOUT_ATOMS and self.arguments[0].ast_type == ast.ASTType.Function:
            return f"{self.name}({self.arguments[0].name})", 1
        return self.name, len(self.arguments)


class _AtomCollector(ast.Transformer):
    """Walks a tree and keeps the predicates with their arguments; changes nothing."""

    def __init__(self) -> None:
        self.found: list[_Predicate] = []

    def visit_SymbolicAtom(self, atom: ast.AST) -> ast.AST:  # noqa: N802 (clingo's naming)
        self._keep(atom.symbol, denied=False)
        return atom

    def _keep(self, symbol: ast.AST, denied: bool) -> None:
        if symbol.ast_type == ast.ASTType.UnaryOperation:  # classical negation
            self._keep(symbol.argument, denied=True)
        elif symbol.ast_type == ast.ASTType.Pool:
            for member in symbol.arguments:
                self._keep(member, denied)
        elif symbol.ast_type == ast.ASTType.Function:
            self.found.append(_Predicate(str(symbol.name), symbol.arguments, denied))


def _atoms(nodes: Iterable[ast.AST]) -> list[_Predicate]:
    collector = _AtomCollector()
    for node in nodes:
        collector.visit(node)
    return collector.found


def _signatures(atoms: Iterable[_Predicate]) -> frozenset[Signature]:
    return frozenset(atom.signature for atom in atoms)
