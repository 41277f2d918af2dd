"""The session that classifies scenes by the shipped axioms, and what it believes by object."""

from __future__ import annotations

import msgspec

from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.reasoning.classification import Classification, ClassificationSession
from ros_scenesense.reasoning.program import Program

SESSION = ClassificationSession(Program.shipped(), time_limit_s=60.0)
KINDS = {axiom.id: axiom.kind for axiom in SESSION.program.axioms}
AXIOMS = list(KINDS)


def beliefs_of(result: Classification) -> dict[str, tuple[Belief, Belief]]:
    """The beliefs without their short explanations."""
    return {
        each.name: (
            msgspec.structs.replace(each.stable, why=""),
            msgspec.structs.replace(each.occluded, why=""),
        )
        for each in result.objects
    }
