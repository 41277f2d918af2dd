"""Beliefs held against labels: right, wrong, undecided or unjudged."""

from __future__ import annotations

from typing import Literal

from ros_scenesense.messages.reasoning import Belief, Beliefs, Verdict
from ros_scenesense.messages.scenes import Labels
from ros_scenesense.scene import Task, Truth


def judge(beliefs: Beliefs, labels: Labels) -> list[Verdict]:
    """A verdict for every belief of a scene.

    A structure is held against the label of exactly its members: one that was perceived with
    other members than it has stays unjudged, and labels of objects and structures that were not
    perceived are not listed.
    """
    # Of several labels for one subject the first counts.
    objects = {label.name: label for label in reversed(labels.objects)}
    structures = {
        tuple(sorted(label.members)): label.stable for label in reversed(labels.structures)
    }
    verdicts = []
    for each in beliefs.objects:
        label = objects.get(each.name)
        stable, occluded = (label.stable, label.occluded) if label else (None, None)
        verdicts.append(_verdict(Task.STABILITY, [each.name], "object", each.stable, stable))
        verdicts.append(_verdict(Task.OCCLUSION, [each.name], "object", each.occluded, occluded))
    for structure in beliefs.structures:
        members, truth = structure.members, structures.get(tuple(sorted(structure.members)))
        verdicts.append(_verdict(Task.STABILITY, members, "structure", structure.stable, truth))
    return verdicts


def _verdict(
    task: Task,
    subject: list[str],
    kind: Literal["object", "structure"],
    belief: Belief,
    label: Truth | None,
) -> Verdict:
    verdict: Literal["right", "wrong", "undecided", "unjudged"]
    if belief.value is None:
        verdict = "undecided"
    elif label is None or label is Truth.AMBIGUOUS:
        verdict = "unjudged"
    else:
        verdict = "right" if belief.value == (label is Truth.TRUE) else "wrong"
    return Verdict(
        task=task,
        subject=subject,
        kind=kind,
        status=belief.status,
        value=belief.value,
        label=label,
        verdict=verdict,
    )
