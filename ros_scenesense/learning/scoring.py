"""How right learned axioms are, held against many labelled objects and what was withheld.

Two axioms are equal if they have the same head and kind and hold of the same objects, whatever
their words; a learned one is right if it is true often enough. Defaults are judged and compared on
what the normal axioms leave open (those that say nothing there are judged on all objects, and equal
none), and a normal axiom that is right equals a default that says no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.columns import bits_of
from ros_scenesense.learning.evaluation import holds
from ros_scenesense.learning.examples import Example

AxiomData = StateConstraint | Default

TRUE_FROM = {"normal": 0.95, "default": 0.70}
"""So often an axiom of a kind must be true; a default, of what normal axioms leave open."""

_SAME = 0.98
"""Two axioms hold of the same objects if those of both are at least so much of those of either."""


@dataclass(frozen=True)
class Judged:
    """A learned axiom.

    Attributes:
        text: Its statement.
        kind: normal or default.
        truth: How often it is true of the objects that it speaks of; None if of none.
        true: Whether that is often enough.
        equals: Id of the withheld axiom with the same extension; None if there is none.
        same_text: Whether the two have the same text too.
    """

    text: str
    kind: str
    truth: float | None
    true: bool
    equals: str | None
    same_text: bool


@dataclass(frozen=True)
class Score:
    """Of a set of learned axioms: each of them, and the ids of the withheld ones among them."""

    judged: tuple[Judged, ...]
    found: tuple[str, ...]


class Judge:
    """Judges axioms about one fluent.

    Args:
        description: The domain, with the axioms that were withheld in learning.
        fluent: What they are about.
        examples: Labelled objects with exact relations.
    """

    def __init__(
        self, description: SystemDescription, fluent: str, examples: Sequence[Example]
    ) -> None:
        self._examples = examples
        self._positive = bits_of(each.label for each in examples)
        self._known: dict[tuple[object, ...], int] = {}
        self.withheld = [
            axiom
            for axiom in description.axioms
            if isinstance(axiom, StateConstraint | Default)
            and axiom.withheld
            and axiom.head.atom.name == fluent
        ]
        self._open = (1 << len(examples)) - 1
        for axiom in self.withheld:
            if axiom.kind == "normal":
                self._open &= ~self._extension(axiom)

    def score(self, axioms: Sequence[AxiomData]) -> Score:
        """Judges learned axioms."""
        judged = tuple(map(self._judge, axioms))
        found = {each.equals for each in judged if each.equals is not None}
        return Score(judged, tuple(each.id for each in self.withheld if each.id in found))

    def _judge(self, axiom: AxiomData) -> Judged:
        held = self._extension(axiom)
        if axiom.kind == "default":
            # One that only repeats normal axioms is true if they are.
            held = held & self._open or held
        labelled = self._positive if axiom.head.positive else ~self._positive
        truth = (held & labelled).bit_count() / held.bit_count() if held else None
        true = truth is not None and truth >= TRUE_FROM[axiom.kind]
        equal = next((each for each in self.withheld if true and self._same(axiom, each)), None)
        return Judged(
            text=str(axiom),
            kind=axiom.kind,
            truth=truth,
            true=true,
            equals=None if equal is None else equal.id,
            same_text=equal is not None and str(equal) == str(axiom),
        )

    def _same(self, one: AxiomData, other: AxiomData) -> bool:
        # A normal axiom that says as much as a default says more than it.
        stronger = (one.kind, other.kind) == ("normal", "default")
        if one.head.positive != other.head.positive or not (one.kind == other.kind or stronger):
            return False
        members = self._open if other.kind == "default" else -1
        first, second = self._extension(one) & members, self._extension(other) & members
        return (first & second).bit_count() >= _SAME * (first | second).bit_count() > 0

    def _extension(self, axiom: AxiomData) -> int:
        """The objects of which its body holds, as bits."""
        key = (axiom.body, axiom.head.atom)
        if key not in self._known:
            self._known[key] = bits_of(
                holds(axiom, each.state, each.target) for each in self._examples
            )
        return self._known[key]
