"""From tests of columns to the axioms that they say."""

from __future__ import annotations

import string
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

from ros_scenesense.knowledge.axioms import Default, Kind, StateConstraint
from ros_scenesense.knowledge.literals import Atom, Belief, Comparison, Condition, Literal
from ros_scenesense.knowledge.terms import Term, Variable
from ros_scenesense.learning.columns import OBJECT, OTHER, Table
from ros_scenesense.learning.trees import Test

Body = frozenset[Test]
LearnedAxiomData = StateConstraint | Default


@dataclass(frozen=True)
class Candidate:
    """An axiom in the making: a label that follows from tests, and how well it did.

    Attributes:
        label: Whether the head is the fluent or its negation.
        body: The tests.
        purity: Share of the examples that the body holds of and that have the label.
        support: Share of the examples that the body holds of.
        votes: Share of the trees that it was found in.
    """

    label: bool
    body: Body
    purity: float = field(default=0.0, compare=False)
    support: float = field(default=0.0, compare=False)
    votes: float = field(default=0.0, compare=False)


@dataclass(frozen=True)
class Learned:
    """An axiom that was learned, without id, and how well it did on the examples."""

    axiom: LearnedAxiomData
    purity: float
    support: float
    votes: float


def holding(table: Table, body: Iterable[Test], members: int) -> int:
    """The examples among `members` of which all tests hold."""
    return reduce(
        lambda left, test: left & (table.bits[test[0]] if test[1] else ~table.bits[test[0]]),
        body,
        members,
    )


def tally(table: Table, label: bool, members: int) -> tuple[int, int]:
    """How many of these examples have a label, and how many they are."""
    labelled = table.positive if label else ~table.positive
    return (members & labelled).bit_count(), members.bit_count()


def is_sayable(table: Table, body: Iterable[Test]) -> bool:
    """Whether a conjunction of literals says it."""
    return all(answer or table.columns[column].if_false is not None for column, answer in body)


def axiom_of(table: Table, candidate: Candidate, fluent: str, kind: Kind) -> LearnedAxiomData:
    """The axiom that a candidate says; its id is empty until somebody gives it one.

    Raises:
        ValueError: If no conjunction of literals says it.
    """
    conditions: list[Condition] = []
    names = iter(string.ascii_uppercase[1:])
    # What holds before what does not, so that it reads well.
    for column, answer in sorted(candidate.body, key=lambda test: (not test[1], test[0])):
        asked = table.columns[column]
        said = asked.if_true if answer else asked.if_false
        if said is None:
            raise ValueError(f"no literal says that {asked} does not hold")
        if any(OTHER in _terms(each) for each in said):
            own = Variable("N") if asked.threshold is not None else Variable(next(names))
            said = tuple(_renamed(each, own) for each in said)
        conditions += [each for each in said if each not in conditions]
    head = Literal(Atom(fluent, (OBJECT,)), candidate.label)
    make: Callable[..., LearnedAxiomData] = Default if kind == "default" else StateConstraint
    return make(id=UNNAMED, head=head, body=tuple(conditions))


UNNAMED = "learned"
"""Id of an axiom that has none of its own yet."""


def learned(
    table: Table, candidates: Sequence[Candidate], fluent: str, kind: Kind
) -> list[Learned]:
    """The axioms of candidates, in their order."""
    return [
        Learned(axiom_of(table, each, fluent, kind), each.purity, each.support, each.votes)
        for each in candidates
    ]


def _terms(condition: Condition) -> tuple[Term, ...]:
    if isinstance(condition, Belief):
        return condition.literal.atom.arguments
    return (condition.left, condition.right) if isinstance(condition, Comparison) else ()


def _renamed(condition: Condition, own: Variable) -> Condition:
    if isinstance(condition, Comparison):
        left, right = (own if each == OTHER else each for each in (condition.left, condition.right))
        return replace(condition, left=left, right=right)
    if isinstance(condition, Belief):
        atom = condition.literal.atom
        arguments = tuple(own if each == OTHER else each for each in atom.arguments)
        literal = Literal(Atom(atom.name, arguments), condition.literal.positive)
        return Belief(literal, condition.negated)
    return condition
