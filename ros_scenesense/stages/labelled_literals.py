"""Labels of a scene as the axiom learner keeps them: literals, each with what reasoning said."""

from __future__ import annotations

from collections.abc import Sequence

from ros_scenesense.learning.examples import Reason
from ros_scenesense.messages.reasoning import Verdict, Verdicts
from ros_scenesense.reasoning.program import FLUENTS
from ros_scenesense.scene import DecisionStatus, Truth

_FLUENT = {task: fluent for fluent, task in FLUENTS.items()}
_REASONS: dict[DecisionStatus, Reason] = {
    DecisionStatus.INCONSISTENT: "inconsistent",
    DecisionStatus.TIMED_OUT: "timed_out",
}


def labelled_literals(
    verdicts: Verdicts, names: Sequence[str]
) -> list[tuple[str, int, bool, Reason]]:
    """Fluent, number of the object, label and reason of each object whose label is clear.

    Args:
        verdicts: Of a scene.
        names: Of its objects, in the order of their numbers.
    """
    number = {name: index for index, name in enumerate(names)}
    return [
        (_FLUENT[each.task], number[each.subject[0]], each.label is Truth.TRUE, _reason(each))
        for each in verdicts.verdicts
        if each.kind == "object"
        and each.label in (Truth.TRUE, Truth.FALSE)
        and each.subject[0] in number
    ]


def _reason(verdict: Verdict) -> Reason:
    if verdict.verdict == "right":
        return "right"
    if verdict.verdict == "wrong":
        return "wrong"
    return _REASONS.get(verdict.status, "undecided")
