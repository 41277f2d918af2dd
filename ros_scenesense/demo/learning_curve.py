"""What learning changed in a run: what reasoning decided from cycle to cycle, axioms, strengths."""

from __future__ import annotations

from collections import defaultdict

import msgspec

from ros_scenesense.demo.finals import share
from ros_scenesense.demo.record import Decision, RunRecord, Subject
from ros_scenesense.scene import Truth


class CycleSummary(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What reasoning alone decided after a learning cycle and before the next one.

    Attributes:
        cycle: Learning cycles so far; 0 = before the first.
        scenes: Scenes that were decided meanwhile.
        axioms: Learned axioms in force.
        decided_share: Share that reasoning decided, of both questions about all objects.
        right_share: Share that it decided rightly, of all whose truth is clear.
        accuracy: Share of right ones among the decided ones that can be judged.
        stability_share: `decided_share` of the question whether an object is stable.
        occlusion_share: The same of the question whether it is occluded.
    """

    cycle: int
    scenes: int
    axioms: int
    decided_share: float | None
    right_share: float | None
    accuracy: float | None
    stability_share: float | None
    occlusion_share: float | None


class AxiomSummary(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A learned axiom: its strength after each cycle in which it was in force, by the cycle."""

    id: str
    text: str
    kind: str
    strengths: dict[int, float]


class LearningSummary(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What was learned in a run, and what that changed."""

    cycles: list[CycleSummary]
    axioms: list[AxiomSummary]


def summarise_learning(record: RunRecord) -> LearningSummary | None:
    """The figures of learning; None if there was no learning cycle."""
    if not record.cycles:
        return None
    decisions: dict[int, list[Decision]] = defaultdict(list)
    scenes: dict[int, int] = defaultdict(int)
    for scene in record.settled():
        if not scene.is_lost:
            scenes[scene.cycle] += 1
            decisions[scene.cycle] += scene.decisions()
    in_force = {each.cycle: len(each.axioms) for each in record.cycles}
    cycles = [
        _cycle(cycle, scenes[cycle], in_force.get(cycle, 0), decisions[cycle])
        for cycle in sorted({0, *in_force, *scenes})
    ]
    axioms: dict[str, AxiomSummary] = {}
    for message in record.cycles:
        for each in message.axioms:
            known = AxiomSummary(id=each.id, text=each.text, kind=each.kind, strengths={})
            strengths = axioms.setdefault(each.id, known).strengths
            strengths[message.cycle] = round(each.strength, 4)
    return LearningSummary(cycles=cycles, axioms=list(axioms.values()))


def _cycle(cycle: int, scenes: int, axioms: int, decisions: list[Decision]) -> CycleSummary:
    about = {
        subject: [each for each in decisions if each.subject is subject]
        for subject in (Subject.STABILITY, Subject.OCCLUSION)
    }
    both = [each for found in about.values() for each in found]
    judged = [each.right for each in both if each.right is not None]
    clear = sum(each.label in (Truth.TRUE, Truth.FALSE) for each in both)
    return CycleSummary(
        cycle=cycle,
        scenes=scenes,
        axioms=axioms,
        decided_share=_decided(both),
        right_share=share(sum(judged), clear),
        accuracy=share(sum(judged), len(judged)),
        stability_share=_decided(about[Subject.STABILITY]),
        occlusion_share=_decided(about[Subject.OCCLUSION]),
    )


def _decided(decisions: list[Decision]) -> float | None:
    return share(sum(each.decided for each in decisions), len(decisions))
