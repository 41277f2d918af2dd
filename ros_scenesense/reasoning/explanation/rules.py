"""Rules rewritten so that the solver writes down which of their instances apply.

A rule `h :- b.` becomes `fired__(index, h, (b as terms)) :- b.`. Grounded with the atoms of an
answer set as facts, what comes out are the instances whose bodies hold. So arithmetic, comparisons,
aggregates and pools mean in an explanation exactly what they mean to the solver.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any

import clingo
from clingo import ast

FIRED = "fired__"
"""Predicate of the rewritten heads; nobody else's rules use it."""

LOCAL = "_"
"""Begins the strings that stand for variables without a value: `_`, or `_B` for the variable B."""


@dataclass(frozen=True, eq=False)
class Head:
    """An atom that a rule can derive.

    Attributes:
        atom: The atom, perhaps classically negated.
        conditions: What must hold besides the body: the condition of an element of a choice.
        chosen: Whether it is a choice or one of several disjuncts: allowed, not forced.
    """

    atom: ast.AST
    conditions: tuple[ast.AST, ...] = ()
    chosen: bool = False


@dataclass(frozen=True, eq=False)
class Rule:
    """A rule that can derive atoms.

    Attributes:
        index: Its place among the statements of the program.
        heads: What it derives.
        body: Its body; anonymous variables of positive literals have names.
    """

    index: int
    heads: tuple[Head, ...]
    body: tuple[ast.AST, ...]

    @classmethod
    def of(cls, index: int, node: ast.AST) -> Rule | None:
        """Reads a statement; None if it derives nothing that could be explained."""
        if node.ast_type != ast.ASTType.Rule:
            return None
        named: ast.AST = _AnonymousNamed().visit(node)
        heads = tuple(_heads(named.head))
        return cls(index, heads, tuple(named.body)) if heads else None

    def rewritten(self) -> Iterator[str]:
        """The rule, once per head, as one that writes itself down."""
        for head in self.heads:
            body = (*self.body, *head.conditions)
            terms = "".join(f"{literal_term(each)}," for each in body)
            condition = f" :- {'; '.join(map(str, body))}" if body else ""
            chosen = int(head.chosen)
            yield f"{FIRED}({self.index},{head.atom},{chosen},({terms or ','})){condition}."


def literal_term(literal: ast.AST) -> str:
    """A body literal as a term: a pair of its sign (0 holds, 1 fails, 2 condition) and content."""
    if literal.ast_type == ast.ASTType.Literal:
        atom = literal.atom
        if atom.ast_type == ast.ASTType.SymbolicAtom:
            if literal.sign == ast.Sign.NoSign:
                return f"(0,{atom})"
            if literal.sign == ast.Sign.Negation:
                return f"(1,{_LocalsNamed().visit(atom)})"
        if atom.ast_type == ast.ASTType.Comparison and literal.sign == ast.Sign.NoSign:
            sides = [atom.term, *(guard.term for guard in atom.guards)]
            if not any(map(_has_several_values, sides)):
                signs = [_COMPARISONS[guard.comparison] for guard in atom.guards]
                rest = zip(signs, sides[1:], strict=True)
                words = [str(sides[0]), *(f'"{sign}",{side}' for sign, side in rest)]
                return f"(2,{','.join(words)})"
    text = str(literal).replace("\\", "\\\\").replace('"', '\\"')
    return f'(2,"{text}")'


def variables_of(node: ast.AST) -> set[str]:
    """Names of the variables of a literal or term, less anonymous ones."""
    finder = _Finder(ast.ASTType.Variable)
    finder.visit(node)
    return {str(each.name) for each in finder.found} - {"_"}


def unbound_as_local(literal: ast.AST, bound: Collection[str]) -> ast.AST:
    """The literal with a string such as `_B` for every variable that is not bound."""
    changed: ast.AST = _LocalsNamed(bound).visit(literal)
    return changed


_COMPARISONS = {
    ast.ComparisonOperator.Equal: "=",
    ast.ComparisonOperator.NotEqual: "!=",
    ast.ComparisonOperator.LessThan: "<",
    ast.ComparisonOperator.LessEqual: "<=",
    ast.ComparisonOperator.GreaterThan: ">",
    ast.ComparisonOperator.GreaterEqual: ">=",
}


def _heads(head: ast.AST) -> Iterator[Head]:
    if head.ast_type == ast.ASTType.Literal:
        if head.atom.ast_type == ast.ASTType.SymbolicAtom and head.sign == ast.Sign.NoSign:
            yield Head(head.atom)
    elif head.ast_type in (ast.ASTType.Aggregate, ast.ASTType.Disjunction):
        for element in head.elements:
            literal = element.literal
            if literal.atom.ast_type == ast.ASTType.SymbolicAtom:
                yield Head(literal.atom, tuple(element.condition), chosen=True)


def _has_several_values(term: ast.AST) -> bool:
    finder = _Finder(ast.ASTType.Interval, ast.ASTType.Pool)
    finder.visit(term)
    return bool(finder.found)


class _Finder(ast.Transformer):
    """Keeps the nodes of some types; changes nothing."""

    def __init__(self, *types: ast.ASTType) -> None:
        self._types = types
        self.found: list[ast.AST] = []

    def visit(self, ast: ast.AST, *args: Any, **kwargs: Any) -> ast.AST:
        if ast.ast_type in self._types:
            self.found.append(ast)
        return super().visit(ast, *args, **kwargs)


_NAMED = "Anonymous__"


class _AnonymousNamed(ast.Transformer):
    """Names the anonymous variables outside negated literals and aggregates."""

    def __init__(self) -> None:
        self._count = 0

    def visit_Literal(self, literal: ast.AST) -> ast.AST:  # noqa: N802 (clingo's naming)
        if literal.sign != ast.Sign.NoSign:
            return literal
        return literal.update(**self.visit_children(literal))

    def visit_BodyAggregate(self, node: ast.AST) -> ast.AST:  # noqa: N802 (clingo's naming)
        return node

    visit_ConditionalLiteral = visit_BodyAggregate  # noqa: N815 (clingo's naming)
    visit_Aggregate = visit_BodyAggregate  # noqa: N815 (clingo's naming)

    def visit_Variable(self, variable: ast.AST) -> ast.AST:  # noqa: N802 (clingo's naming)
        if variable.name != "_":
            return variable
        self._count += 1
        return variable.update(name=f"{_NAMED}{self._count}")


class _LocalsNamed(ast.Transformer):
    """Writes strings for variables that have no value: anonymous ones, or all but the bound."""

    def __init__(self, bound: Collection[str] | None = None) -> None:
        self._bound = bound

    def visit_Variable(self, variable: ast.AST) -> ast.AST:  # noqa: N802 (clingo's naming)
        anonymous = variable.name == "_"
        if not anonymous and (self._bound is None or variable.name in self._bound):
            return variable
        name = "" if anonymous or variable.name.startswith(_NAMED) else variable.name
        return ast.SymbolicTerm(variable.location, clingo.String(LOCAL + name))
