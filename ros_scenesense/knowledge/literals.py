"""Literals and the conditions in the bodies of axioms.

Two negations: classical, `-p`, "p is believed to be false", is part of a `Literal`; default
negation, `not p`, "p is not believed", is part of a `Condition`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.terms import Place, Term, Variable, check_name, collect_variables

COMPARISONS = ("=", "!=", "<", "<=", ">", ">=")


@dataclass(frozen=True, slots=True)
class Atom:
    """A static, fluent or action with its arguments, e.g. `above(A, B)`.

    Raises:
        LanguageError: If the name is none.
    """

    name: str
    arguments: tuple[Term, ...] = ()
    place: Place | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        check_name(self.name)

    def __str__(self) -> str:
        return (
            f"{self.name}({', '.join(map(str, self.arguments))})" if self.arguments else self.name
        )


@dataclass(frozen=True, slots=True)
class Literal:
    """A domain literal: an atom or, with `positive=False`, its negation, `-above(A, B)`."""

    atom: Atom
    positive: bool = True

    @property
    def complement(self) -> Literal:
        """The literal that says the opposite."""
        return Literal(self.atom, not self.positive)

    def __str__(self) -> str:
        return str(self.atom) if self.positive else f"-{self.atom}"


@dataclass(frozen=True, slots=True)
class Belief:
    """A condition on a literal: that it is believed or, with `negated`, that it is not.

    A variable of a negated belief that occurs nowhere else in the statement is local:
    `not above(A, B)` says that A is above no B at all (paper, statements on learned axioms).
    """

    literal: Literal
    negated: bool = False

    def __str__(self) -> str:
        return f"not {self.literal}" if self.negated else str(self.literal)


@dataclass(frozen=True, slots=True)
class Membership:
    """A condition on a term: that it belongs to a sort or, with `negated`, that it does not."""

    sort: str
    term: Term
    negated: bool = False
    place: Place | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        check_name(self.sort)

    def __str__(self) -> str:
        return f"{'not ' if self.negated else ''}{self.sort}({self.term})"


@dataclass(frozen=True, slots=True)
class Comparison:
    """A condition `left operator right`; the operator is one of `COMPARISONS`."""

    operator: str
    left: Term
    right: Term
    place: Place | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.operator not in COMPARISONS:
            raise LanguageError(f"{self.operator!r} is no comparison: {' '.join(COMPARISONS)}")

    def __str__(self) -> str:
        return f"{self.left} {self.operator} {self.right}"


Condition = Belief | Membership | Comparison


def terms_of(part: Atom | Literal | Condition) -> tuple[Term, ...]:
    """The outermost terms of an atom, a literal or a condition."""
    if isinstance(part, Belief):
        part = part.literal
    if isinstance(part, Literal):
        part = part.atom
    if isinstance(part, Atom):
        return part.arguments
    return (part.term,) if isinstance(part, Membership) else (part.left, part.right)


def variables_of(part: Atom | Literal | Condition) -> Iterator[Variable]:
    """Its variables, from left to right, as often as they occur."""
    found: list[Variable] = []
    collect_variables(terms_of(part), found)
    return iter(found)
