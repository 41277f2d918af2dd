"""`scenesense goal`: what is printed of a plan; the conversation itself is tried with the nodes."""

import pytest

from ros_scenesense.cli.goal import told
from ros_scenesense.messages.actions import Plan, PlannedAction
from ros_scenesense.messages.base import Stamp


def plan(outcome: str, reason: str = "", actions=()) -> Plan:
    return Plan(
        stamp=Stamp.of(1),
        scene_id="s-1",
        id="g",
        goal="on(a, b)",
        outcome=outcome,
        actions=list(actions),
        reason=reason,
    )


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (plan("reached"), "reached in scene s-1"),
        (plan("no_plan", "why"), "no plan in scene s-1: why"),
        (
            plan(
                "found",
                "after pickup(a)",
                [
                    PlannedAction(kind="pickup", object="a\x1b[2J"),
                    PlannedAction(kind="putdown", object="a", location="b"),
                ],
            ),
            "plan in scene s-1: after pickup(a)\n  pickup(a?[2J)\n  putdown(a, b)",
        ),
    ],
)
def test_a_plan_is_told_in_words(message, words):
    assert told(message) == words
