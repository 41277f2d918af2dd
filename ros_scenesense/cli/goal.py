"""Give the robot of the running graph a goal, and tell how it pursues it."""

from __future__ import annotations

import argparse
import uuid

from ros_scenesense.cli.launch import add_domain_arguments, add_timeout_argument
from ros_scenesense.messages.actions import Goal, Plan, PlannedAction
from ros_scenesense.stages.goal_words import words_of

_EPILOG = """\
Prints every plan, and the reason why it was planned anew. Exit code: 0 when the goal is reached, 3
when it is refused or not reached, 2 for a wrong value, 1 when no node answers. docs/planning.md
tells what goals are.
"""
_NOT_REACHED = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense goal`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    parser.add_argument("goal", metavar="GOAL", help="what is to hold in the end")
    add_domain_arguments(parser)
    add_timeout_argument(parser, 300.0, "to pursue the goal")


def run(arguments: argparse.Namespace) -> int:
    """Publishes the goal, and prints what becomes of it."""
    # Imports ROS: not for `--help`.
    from ros_scenesense.cli.conversation import ask

    goal = Goal(id=f"command-{uuid.uuid4().hex}", goal=arguments.goal)

    def is_last_word(plan: Plan) -> bool:
        if plan.id != goal.id:
            return False
        print(told(plan), flush=True)
        return plan.outcome != "found"

    last = ask(arguments, goal, Plan, is_last_word)
    return 0 if last.outcome == "reached" else _NOT_REACHED


def told(plan: Plan) -> str:
    """A plan in words; names of objects may hold anything, but nothing that moves the cursor."""
    reason = f": {_printable(plan.reason)}" if plan.reason else ""
    if plan.outcome != "found":
        return f"{plan.outcome.replace('_', ' ')} in scene {plan.scene_id}{reason}"
    return "\n".join([f"plan in scene {plan.scene_id}{reason}", *map(_line, plan.actions)])


def _line(action: PlannedAction) -> str:
    return f"  {_printable(words_of(action))}"


def _printable(text: str) -> str:
    return "".join(each if each.isprintable() else "?" for each in text)
