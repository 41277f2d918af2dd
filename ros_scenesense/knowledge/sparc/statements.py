"""What a SPARC program says, in statements: terms and literals are those of `knowledge`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

from ros_scenesense.knowledge.literals import Belief, Comparison, Literal, Membership
from ros_scenesense.knowledge.terms import Arithmetic, Place, Record, Term, Variable


@dataclass(frozen=True, slots=True)
class SortTest:
    """`#s(X)` or `not #s(X)`; in a display section perhaps without term."""

    sort: str
    term: Term | None
    place: Place


Atomic = Literal | SortTest
Condition = Belief | Comparison | Membership
"""A condition of a body; a `Membership` is a test of a sort."""


@dataclass(frozen=True, slots=True)
class Bound:
    """`term operator`, or `operator term`, beside an aggregate or a choice."""

    operator: str
    term: Term


@dataclass(frozen=True, slots=True)
class Element:
    """An element in braces: terms of an aggregate or the literal of a choice, and conditions."""

    terms: tuple[Term, ...]
    literal: Literal | None
    conditions: tuple[Condition, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Aggregate:
    """`left operator #function { elements } operator right`; at least one of the bounds."""

    function: str
    elements: tuple[Element, ...]
    left: Bound | None
    right: Bound | None
    place: Place


@dataclass(frozen=True, slots=True)
class Choice:
    """`left { elements } right` in a head; a bound without operator says `<=`."""

    elements: tuple[Element, ...]
    left: Bound | None
    right: Bound | None


class Form(StrEnum):
    """What a rule is: its sign in the text."""

    RULE = ":-"
    CR = ":+"
    WEAK = ":~"
    MINIMIZE = "#minimize"
    MAXIMIZE = "#maximize"


@dataclass(frozen=True)
class Rule:
    """A rule, a CR rule, a weak constraint, or one element of an optimisation.

    Attributes:
        form: What it is.
        head: The literals of a disjunction, or a choice; empty for constraints.
        body: Its conditions.
        label: Name of a CR rule; empty if it has none.
        weight: What a weak constraint or an element costs.
        level: Its priority.
        terms: The other terms of an element.
        place: Where it begins.
    """

    form: Form
    head: tuple[Literal, ...] | Choice = ()
    body: tuple[Condition | Aggregate, ...] = ()
    label: str = ""
    weight: Term | None = None
    level: Term | None = None
    terms: tuple[Term, ...] = ()
    place: Place = field(default=Place("made by a program", 1, 1), compare=False)

    @cached_property
    def heads(self) -> tuple[Literal, ...]:
        """The literals of the head, if it is no choice."""
        return self.head if isinstance(self.head, tuple) else ()

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """The body without aggregates."""
        return tuple(each for each in self.body if not isinstance(each, Aggregate))

    @cached_property
    def groups(self) -> tuple[Aggregate | Choice, ...]:
        """What has elements: the choice and the aggregates."""
        choice = (self.head,) if isinstance(self.head, Choice) else ()
        return (*choice, *(each for each in self.body if isinstance(each, Aggregate)))

    @cached_property
    def bounds(self) -> tuple[Term, ...]:
        """The terms beside aggregates and choices, weight and level."""
        found = [
            bound.term for group in self.groups for bound in (group.left, group.right) if bound
        ]
        return (*found, *(each for each in (self.weight, self.level) if each is not None))


@dataclass(frozen=True, slots=True)
class Facts:
    """`p(1..3).`, a fact for each number."""

    name: str
    low: int
    high: int
    place: Place


@dataclass(frozen=True, slots=True)
class Predicate:
    """The declaration `p(#s, #t).` of a predicate."""

    name: str
    sorts: tuple[Named, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Named:
    """`#s`, where a sort stands."""

    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class Range:
    """`low..high`, numbers or identifiers."""

    low: int | str
    high: int | str
    place: Place


@dataclass(frozen=True, slots=True)
class Members:
    """`{a, f(b), 3}`."""

    terms: tuple[Term, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Related:
    """A condition of a record: `X < Y`, or conditions joined by `and`, `or`, `not`."""

    operator: str
    parts: tuple[Related | Variable, ...]


@dataclass(frozen=True, slots=True)
class Records:
    """`f(#s(X), #t(Y)) : condition`."""

    functor: str
    sorts: tuple[Named, ...]
    variables: tuple[Variable | None, ...]
    condition: Related | None
    place: Place


@dataclass(frozen=True, slots=True)
class Concatenation:
    """`[book][1..3]`."""

    pieces: tuple[Range | Members | Named, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Combined:
    """`one + other`, `one * other`, `one - other`; a sum may have many parts."""

    operator: str
    parts: tuple[Expression, ...]
    place: Place


Expression = Named | Range | Members | Records | Concatenation | Combined


@dataclass(frozen=True, slots=True)
class SortDefinition:
    """The definition `#s = expression.` of a sort."""

    name: str
    expression: Expression
    place: Place


@dataclass(frozen=True, slots=True)
class Text:
    """All statements of a program.

    Attributes:
        sorts: The definitions of sorts.
        predicates: The declarations.
        rules: In order; facts of a range of numbers among them.
        display: What answers show; None if there is no such section.
        largest: The largest number, `#maxint`.
        constants: The values of constants.
        names: All identifiers that occur, and those of statements that could not be read.
        unread: Names in statements that could not be read; nothing is to be said about them.
    """

    sorts: tuple[SortDefinition, ...]
    predicates: tuple[Predicate, ...]
    rules: tuple[Rule | Facts, ...]
    display: tuple[Atomic, ...] | None
    largest: int
    constants: dict[str, int]
    names: frozenset[str]
    unread: frozenset[str]


def arithmetics(terms: Iterable[Term]) -> list[Arithmetic]:
    """The outermost arithmetic in terms."""
    found: list[Arithmetic] = []
    for term in terms:
        if isinstance(term, Arithmetic):
            found.append(term)
        elif isinstance(term, Record):
            found += arithmetics(term.arguments)
    return found


def is_anonymous(variable: Variable) -> bool:
    """Whether the variable was written `_`; people's variables begin with a letter."""
    return variable.name.startswith("_")
