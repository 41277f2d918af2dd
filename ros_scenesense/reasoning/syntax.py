"""What the statements of a logic program speak of, read from clingo's syntax tree.

Heads and bodies as predicates tell which rules bear on the answer and which facts they need; the
tagged heads `pos(fluent(...), axiom)` and the guards `enabled(axiom)` tell the axioms apart.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from clingo import ast

Signature = tuple[str, int]
"""Name and number of arguments of a predicate."""

CONCLUSIONS = frozenset({("pos", 1), ("neg", 1), ("pos", 2), ("neg", 2)})
"""The predicates that say what the program concludes of a fluent."""


@dataclass(frozen=True, eq=False)
class Statement:
    """A statement of a program.

    Attributes:
        node: Its syntax tree.
        heads: Predicates that it defines; empty for everything that is not a rule with a head.
        bodies: Predicates that it needs.
        guards: Ids of axioms without which a rule does not apply.
        concludes: Pairs (fluent, axiom) of tagged conclusions in the head; the fluent without its
            argument, or the whole term where it is not one fluent of one object.
    """

    node: ast.AST
    heads: frozenset[Signature]
    bodies: frozenset[Signature]
    guards: frozenset[str]
    concludes: frozenset[tuple[str, str]]

    @classmethod
    def of(cls, node: ast.AST) -> Statement:
        """Reads a syntax tree."""
        if node.ast_type == ast.ASTType.ShowSignature:
            shown = frozenset({(str(node.name), int(node.arity))})
            return cls(node, frozenset(), shown, frozenset(), frozenset())
        if node.ast_type != ast.ASTType.Rule:
            return cls(node, frozenset(), _signatures(_atoms([node])), frozenset(), frozenset())
        head, body = _atoms([node.head]), _atoms(node.body)
        # A choice or an aggregate in the head also holds conditions.
        plain = node.head.ast_type == ast.ASTType.Literal
        return cls(
            node,
            heads=_signatures(head),
            bodies=_signatures(body if plain else head + body),
            guards=frozenset(
                str(atom.arguments[0]) for atom in body if _signature(atom) == ("enabled", 1)
            ),
            concludes=frozenset(
                (_fluent(atom.arguments[0]), str(atom.arguments[1]))
                for atom in head
                if _signature(atom) in CONCLUSIONS and len(atom.arguments) == 2
            ),
        )

    @property
    def place(self) -> str:
        """Line and column where it begins, as `line:column`."""
        begin = self.node.location.begin
        return f"{begin.line}:{begin.column}"


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


class _AtomCollector(ast.Transformer):
    """Walks a tree and keeps the predicates with their arguments; changes nothing."""

    def __init__(self) -> None:
        self.found: list[ast.AST] = []

    def visit_SymbolicAtom(self, atom: ast.AST) -> ast.AST:  # noqa: N802 (clingo's naming)
        self._keep(atom.symbol)
        return atom

    def _keep(self, symbol: ast.AST) -> None:
        if symbol.ast_type == ast.ASTType.UnaryOperation:  # classical negation
            self._keep(symbol.argument)
        elif symbol.ast_type == ast.ASTType.Pool:
            for member in symbol.arguments:
                self._keep(member)
        elif symbol.ast_type == ast.ASTType.Function:
            self.found.append(symbol)


def _atoms(nodes: Iterable[ast.AST]) -> list[ast.AST]:
    collector = _AtomCollector()
    for node in nodes:
        collector.visit(node)
    return collector.found


def _signature(atom: ast.AST) -> Signature:
    return str(atom.name), len(atom.arguments)


def _signatures(atoms: Iterable[ast.AST]) -> frozenset[Signature]:
    return frozenset(_signature(atom) for atom in atoms)


def _fluent(term: ast.AST) -> str:
    of_one = term.ast_type == ast.ASTType.Function and len(term.arguments) == 1
    return str(term.name) if of_one else str(term)
