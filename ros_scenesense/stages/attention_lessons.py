"""What a labelled scene teaches attention: examples of what reasoning lacks, purity of defaults."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from ros_scenesense.attention.queries import Query
from ros_scenesense.messages.attention import Example, Examples
from ros_scenesense.messages.reasoning import Beliefs, Verdict, Verdicts
from ros_scenesense.scene import DecisionStatus, Task, Truth

Reason = Literal["undecided", "inconsistent", "timed_out", "wrong"]
_REASONS: dict[DecisionStatus, Reason] = {
    DecisionStatus.UNDECIDED: "undecided",
    DecisionStatus.INCONSISTENT: "inconsistent",
    DecisionStatus.TIMED_OUT: "timed_out",
}


def lacking_of(verdicts: Verdicts) -> dict[tuple[str, Task], Verdict]:
    """The literals of objects that reasoning left undecided or got wrong, where a label tells."""
    return {
        (verdict.subject[0], verdict.task): verdict
        for verdict in verdicts.verdicts
        if verdict.kind == "object"
        and verdict.verdict in ("undecided", "wrong")
        and verdict.label in (Truth.TRUE, Truth.FALSE)
    }


def conclusions_of(beliefs: Beliefs, verdicts: Verdicts) -> list[tuple[str, bool]]:
    """The defaults that reasoning drew on, each with whether it was right."""
    known = {
        (each.name, task): belief
        for each in beliefs.objects
        for task, belief in ((Task.STABILITY, each.stable), (Task.OCCLUSION, each.occluded))
    }
    return [
        (axiom, verdict.verdict == "right")
        for verdict in verdicts.verdicts
        if verdict.kind == "object"
        and verdict.status is DecisionStatus.BY_DEFAULT
        and verdict.verdict in ("right", "wrong")
        and (verdict.subject[0], verdict.task) in known
        for axiom in known[verdict.subject[0], verdict.task].axioms
    ]


def examples_of(
    revision: str, verdicts: Verdicts, labelled: Iterable[tuple[Query, bool]]
) -> Examples:
    """The message about the examples of a scene.

    Args:
        revision: Of the knowledge that reasoning had.
        verdicts: About the scene.
        labelled: Queries about what reasoning lacks, with their labels.
    """
    lacking = lacking_of(verdicts)
    return Examples(
        stamp=verdicts.stamp,
        scene_id=verdicts.scene_id,
        knowledge_revision=revision,
        examples=[
            Example(
                task=query.task,
                target=query.target,
                label=label,
                objects=list(query.objects),
                reason=_REASONS.get(lacking[query.target, query.task].status, "wrong"),
            )
            for query, label in labelled
        ],
    )
