from __future__ import annotations

import pytest

from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.reasoning import Belief, Beliefs, ObjectBelief, StructureBelief
from ros_scenesense.messages.scenes import Labels, ObjectLabel, StructureLabel
from ros_scenesense.reasoning.verdicts import judge
from ros_scenesense.scene import DecisionStatus, Task, Truth

YES = Belief(status=DecisionStatus.STRICT, value=True, axioms=["s1"])
NO = Belief(status=DecisionStatus.BY_DEFAULT, value=False, axioms=["s3"])
OPEN = Belief(status=DecisionStatus.UNDECIDED)
CLASH = Belief(status=DecisionStatus.INCONSISTENT, axioms=["s1", "s3"])


def beliefs(objects: dict[str, Belief], structures: dict[str, Belief]) -> Beliefs:
    return Beliefs(
        stamp=Stamp.of(0),
        scene_id="x-1",
        objects=[ObjectBelief(name=n, stable=b, occluded=OPEN) for n, b in objects.items()],
        structures=[StructureBelief(members=list(m), stable=b) for m, b in structures.items()],
        derived=[],
        knowledge_revision="k",
        trust_revision=0,
    )


def labels(objects: dict[str, Truth], structures: dict[str, Truth]) -> Labels:
    return Labels(
        stamp=Stamp.of(0),
        scene_id="x-1",
        use="evaluate",
        objects=[ObjectLabel(name=n, stable=t, occluded=Truth.FALSE) for n, t in objects.items()],
        structures=[StructureLabel(members=list(m), stable=t) for m, t in structures.items()],
    )


@pytest.mark.parametrize(
    ("belief", "label", "expected"),
    [
        (YES, Truth.TRUE, "right"),
        (YES, Truth.FALSE, "wrong"),
        (NO, Truth.FALSE, "right"),
        (NO, Truth.TRUE, "wrong"),
        (YES, Truth.AMBIGUOUS, "unjudged"),
        (OPEN, Truth.TRUE, "undecided"),
        (CLASH, Truth.FALSE, "undecided"),
        (OPEN, Truth.AMBIGUOUS, "undecided"),
    ],
)
def test_an_object_is_held_against_its_label(belief: Belief, label: Truth, expected: str) -> None:
    stability, occlusion = judge(beliefs({"a": belief}, {}), labels({"a": label}, {}))
    assert (stability.task, stability.kind, stability.subject) == (
        Task.STABILITY,
        "object",
        ["a"],
    )
    assert (stability.status, stability.value, stability.label, stability.verdict) == (
        belief.status,
        belief.value,
        label,
        expected,
    )
    assert (occlusion.task, occlusion.label, occlusion.verdict) == (
        Task.OCCLUSION,
        Truth.FALSE,
        "undecided",
    )


def test_an_object_without_label_is_unjudged_and_a_label_without_object_is_not_listed() -> None:
    verdicts = judge(beliefs({"a": YES}, {}), labels({"b": Truth.TRUE}, {}))
    assert [(each.subject, each.label, each.verdict) for each in verdicts] == [
        (["a"], None, "unjudged"),
        (["a"], None, "undecided"),
    ]


def test_structures_are_matched_by_their_members() -> None:
    perceived = beliefs({}, {"ab": NO, "c": YES, "de": YES, "f": OPEN})
    truth = labels({}, {"ba": Truth.FALSE, "cd": Truth.TRUE, "e": Truth.TRUE, "f": Truth.TRUE})
    verdicts = judge(perceived, truth)
    assert {each.kind for each in verdicts} == {"structure"}
    assert {"".join(each.subject): (each.label, each.verdict) for each in verdicts} == {
        "ab": (Truth.FALSE, "right"),
        "c": (None, "unjudged"),
        "de": (None, "unjudged"),
        "f": (Truth.TRUE, "undecided"),
    }
