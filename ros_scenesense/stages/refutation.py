"""What labelled objects say for and against axioms that are there already, whoever said them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.learning.confidence import belief, difference, lower_bound
from ros_scenesense.learning.evaluation import holds
from ros_scenesense.learning.examples import Example

AxiomData = StateConstraint | Default

_FEWEST = 8
"""An axiom is refuted, or supported again, by at least so many objects that it speaks of ..."""

_REFUTING_Z = 2.0
"""... and refuted only if even the upper bound of its truth is below what is asked of its kind."""

_CHANGE_Z = 3.5
"""By so many standard deviations an axiom is less true now where the world has changed."""

_SUPPORTED = 0.5
"""An axiom is supported again if it is true often enough with this probability."""


@dataclass(frozen=True)
class Refuted:
    """An axiom that is true too seldom, and of how many objects it is true.

    Attributes:
        axiom: The axiom.
        hits: Objects that it is true of.
        count: Objects that it speaks of.
        changed: Whether it was true before, so that the world must have changed.
    """

    axiom: AxiomData
    hits: int
    count: int
    changed: bool

    def __str__(self) -> str:
        since = ", though it was true before" if self.changed else ""
        return f"true of {self.hits} of {self.count} labelled objects only{since}"


class Evidence:
    """Labelled objects, and how true axioms must be of them.

    Args:
        items: All objects.
        recent: Ids of the newest scenes.
        normal: How often a normal axiom must be true.
        default: The same of a default, of what normal axioms leave open.
    """

    def __init__(
        self, items: Sequence[Example], recent: Collection[str], normal: float, default: float
    ) -> None:
        self._items = items
        self._recent = [each for each in items if each.scene_id in recent]
        self._earlier = [each for each in items if each.scene_id not in recent]
        self._least = {"normal": normal, "default": default}

    def against(self, axioms: Sequence[AxiomData], strict: Sequence[AxiomData]) -> list[Refuted]:
        """Those axioms that are true too seldom: of the newest objects, or of all.

        Args:
            axioms: What is asked about.
            strict: Normal axioms in force, which overrule defaults.
        """
        found = []
        for axiom in axioms:
            now = self._tally(axiom, strict, self._recent)
            if self._speaks_against(axiom, *now):
                earlier = self._tally(axiom, strict, self._earlier)
                found.append(Refuted(axiom, *now, difference(*earlier, *now) >= _CHANGE_Z))
                continue
            whole = self._tally(axiom, strict, self._items)
            if self._speaks_against(axiom, *whole):
                found.append(Refuted(axiom, *whole, changed=False))
        return found

    def in_favour(self, axiom: AxiomData, strict: Sequence[AxiomData]) -> str | None:
        """Why an axiom can be believed, in words; None if it cannot."""
        hits, count = self._tally(axiom, strict, self._items)
        if count < _FEWEST or belief(hits, count, self._least[axiom.kind]) < _SUPPORTED:
            return None
        return f"true of {hits} of {count} labelled objects"

    def _speaks_against(self, axiom: AxiomData, hits: int, count: int) -> bool:
        highest = 1.0 - lower_bound(count - hits, count, _REFUTING_Z)
        return count >= _FEWEST and highest < self._least[axiom.kind]

    def _tally(
        self, axiom: AxiomData, strict: Sequence[AxiomData], items: Sequence[Example]
    ) -> tuple[int, int]:
        overruling = strict if axiom.kind == "default" else ()
        labels = [
            each.label
            for each in items
            if holds(axiom, each.state, each.target)
            and not any(holds(other, each.state, each.target) for other in overruling)
        ]
        return labels.count(axiom.head.positive), len(labels)
