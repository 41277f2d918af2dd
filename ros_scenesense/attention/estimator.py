"""The final decision: reasoning where it decides, the network where it does not.

Two modes. `decide` is the paper's: what a default concludes stands. With `overrule`, a calibrated
network may contradict a conclusion drawn by defaults alone, if it is surer of the opposite than the
default has turned out to be right on labelled scenes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from ros_scenesense.messages.attention import (
    Estimate,
    EstimateSource,
    ObjectEstimate,
    StructureEstimate,
)
from ros_scenesense.messages.reasoning import Belief, Beliefs
from ros_scenesense.scene import DecisionStatus, Task, structure_truth

Answers = Mapping[tuple[str, Task], float | None]
"""The network's probability that a literal is true; None where it took too long to say."""

_STRENGTH: dict[EstimateSource, int] = {
    "reasoning": 3,
    "default": 2,
    "network": 1,
    "none": 0,
    "timeout": 0,
}
_NOBODY = Estimate(value=None, source="none")
_TOO_LATE = Estimate(value=None, source="timeout")


@dataclass(frozen=True)
class Estimator:
    """How decisions are made.

    Attributes:
        defaults: `decide`: a default's conclusion stands; `overrule`: the network may contradict.
        confidence: The network abstains where its decision would be less probable; from 0.5 (never)
            to 1.
        purity: Share of right conclusions per default, as measured on labelled scenes. One that was
            never measured is not overruled.
    """

    defaults: Literal["decide", "overrule"] = "decide"
    confidence: float = 0.5
    purity: Mapping[str, float] = field(default_factory=dict)

    def objects(self, beliefs: Beliefs, answers: Answers) -> list[ObjectEstimate]:
        """The decisions about all objects of a scene."""
        return [
            ObjectEstimate(
                name=each.name,
                stable=self._decide(each.stable, (each.name, Task.STABILITY), answers),
                occluded=self._decide(each.occluded, (each.name, Task.OCCLUSION), answers),
            )
            for each in beliefs.objects
        ]

    def structures(
        self, beliefs: Beliefs, objects: Iterable[ObjectEstimate]
    ) -> list[StructureEstimate]:
        """The decisions about all structures, from those about their members."""
        stable = {each.name: each.stable for each in objects}
        return [
            StructureEstimate(
                members=each.members,
                stable=_of_structure([stable[name] for name in each.members if name in stable]),
            )
            for each in beliefs.structures
        ]

    def decide(self, belief: Belief, probability: float | None) -> Estimate:
        """The decision about one literal.

        Args:
            belief: What reasoning says.
            probability: What the network says, from 0 to 1; None where it was not asked.
        """
        network = self._network(probability)
        if belief.value is None:
            return network
        if belief.status is not DecisionStatus.BY_DEFAULT:
            return Estimate(value=belief.value, source="reasoning")
        purity = max((self.purity.get(axiom, 1.0) for axiom in belief.axioms), default=1.0)
        opposite = network.value is not None and network.value != belief.value
        if self.defaults == "overrule" and opposite and (network.probability or 0.0) > purity:
            return network
        known = any(axiom in self.purity for axiom in belief.axioms)
        return Estimate(value=belief.value, source="default", probability=purity if known else None)

    def _decide(self, belief: Belief, key: tuple[str, Task], answers: Answers) -> Estimate:
        decided = self.decide(belief, answers.get(key))
        late = belief.status is DecisionStatus.TIMED_OUT or answers.get(key, 0.0) is None
        return _TOO_LATE if decided is _NOBODY and late else decided

    def _network(self, probability: float | None) -> Estimate:
        if probability is None:
            return _NOBODY
        surer = max(probability, 1.0 - probability)
        if surer < self.confidence:
            return _NOBODY
        return Estimate(value=probability >= 0.5, source="network", probability=surer)


def measured_purity(counts: Mapping[str, tuple[int, int]]) -> dict[str, float]:
    """The purity of each axiom from how often it was right and how often wrong.

    One right and one wrong conclusion are added, so that few scenes make nobody sure.
    """
    return {axiom: (right + 1) / (right + wrong + 2) for axiom, (right, wrong) in counts.items()}


def _of_structure(members: Sequence[Estimate]) -> Estimate:
    """Unstable if one member is, stable if all are: as surely as that is known of the members."""
    truth = structure_truth(
        map(str, range(len(members))),
        {str(number): member.value for number, member in enumerate(members)},
    )
    if truth is None:
        return _TOO_LATE if _TOO_LATE in members else _NOBODY
    deciding = [member for member in members if member.value == truth]
    if truth:
        # All must be stable: the weakest source speaks for the whole.
        source = min((member.source for member in deciding), key=_STRENGTH.__getitem__)
        probability = _least(member.probability for member in deciding)
    else:
        surest = max(deciding, key=lambda each: (_STRENGTH[each.source], each.probability or 0.0))
        source, probability = surest.source, surest.probability
    return Estimate(value=truth, source=source, probability=probability)


def _least(probabilities: Iterable[float | None]) -> float | None:
    return min((each for each in probabilities if each is not None), default=None)
