"""Why each action of a plan: what would fail without it.

A plan is followed once more for each of its actions, without that action and with the rest as it
stands. What then becomes impossible, or is not achieved, is what the action is for. The program is
the planner's own, so that an action means here what it meant when it was planned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import clingo

from ros_scenesense.knowledge.description import GoalCondition, Quantity
from ros_scenesense.knowledge.literals import Atom
from ros_scenesense.knowledge.transition_program import AVOIDED, TransitionProgram
from ros_scenesense.reasoning.planning import PlanningTask
from ros_scenesense.reasoning.program import Messages


@dataclass(frozen=True)
class Purpose:
    """What an action of a plan is for.

    Attributes:
        action: The action.
        step: Its step, counted from 0.
        enables: The next action that would be impossible without it; None if there is none.
        enabled_step: The step of that action.
        because: The statement that would make that action impossible, in words.
        achieves: The conditions of the goal that would not hold in the end without it.
    """

    action: Atom
    step: int
    enables: Atom | None = None
    enabled_step: int | None = None
    because: str = ""
    achieves: tuple[GoalCondition, ...] = ()

    def __str__(self) -> str:
        words = []
        if self.enables is not None:
            words.append(
                f"without it {self.enables} at step {self.enabled_step} would be impossible: "
                f"{self.because}"
            )
        if self.achieves:
            goal = ", ".join(map(str, self.achieves))
            words.append(f"without it the goal would not be achieved: {goal}")
        return "; ".join(words) or "the plan would achieve the goal without it"


def purposes(task: PlanningTask, actions: Sequence[Atom]) -> tuple[Purpose, ...]:
    """What each action of a plan is for.

    Args:
        task: As it was given to the planner.
        actions: The plan.

    Raises:
        ReasoningError: If the solver fails.
    """
    before = _followed(task, actions)
    return tuple(_purpose(task, actions, step, before) for step in range(len(actions)))


@dataclass(frozen=True)
class _Followed:
    """What comes of following some actions: what was violated at which step, what is unmet."""

    violated: tuple[tuple[int, str], ...]
    unmet: tuple[GoalCondition, ...]


def _purpose(task: PlanningTask, actions: Sequence[Atom], step: int, before: _Followed) -> Purpose:
    rest = [*actions[:step], *actions[step + 1 :]]
    found = _followed(task, rest)
    achieves = tuple(each for each in found.unmet if each not in before.unmet)
    # Without an action, those after it come one step sooner.
    violated = [each for each in found.violated if each[0] > step]
    purpose = Purpose(actions[step], step, achieves=achieves)
    if not violated:
        return purpose
    number, identifier = violated[0]
    return replace(
        purpose,
        enables=rest[number - 1],
        enabled_step=number,
        because=_words(task, identifier),
    )


def _followed(task: PlanningTask, actions: Sequence[Atom]) -> _Followed:
    conditions = [each for each in task.goal.conditions if each.quantity is not Quantity.FEWEST]
    asked = [condition.literal for condition in task.goal.conditions]
    program = TransitionProgram(task.description, asked, task.initial, task.avoided, lenient=True)
    with Messages("plan") as messages:
        unmet = [
            condition
            for condition in conditions
            if _violations(task, program, actions, condition, messages) is None
        ]
        violated = _violations(task, program, actions, None, messages)
    return _Followed(tuple(sorted(violated or ())), tuple(unmet))


def _violations(
    task: PlanningTask,
    program: TransitionProgram,
    actions: Sequence[Atom],
    condition: GoalCondition | None,
    messages: Messages,
) -> list[tuple[int, str]] | None:
    """What the actions violate; None if a condition does not hold in the end."""
    violated, end = program.helper("violated"), len(actions)
    goal = replace(task.goal, conditions=() if condition is None else (condition,))
    control = clingo.Control(["--warn=no-atom-undefined"], logger=messages.take)
    occurring = "\n".join(
        f"{program.occurring(action, str(step))}." for step, action in enumerate(actions, start=1)
    )
    parts = [program.text(), program.avoidance(), program.goal(goal), "#program base.", occurring]
    control.add("base", [], "\n".join(parts))
    control.ground([("base", []), ("state", [clingo.Number(0)])])
    for step in range(1, end + 1):
        number = [clingo.Number(step)]
        control.ground([(part, number) for part in ("step", "state", "avoidance")])
    control.ground([("goal", [clingo.Number(end)])])
    if condition is not None:
        query = clingo.Function(program.helper("query"), [clingo.Number(end)])
        control.assign_external(query, True)
    found: list[list[tuple[int, str]]] = []

    def take(model: clingo.Model) -> None:
        atoms = [each for each in model.symbols(atoms=True) if each.match(violated, 2)]
        found.append([(each.arguments[1].number, each.arguments[0].string) for each in atoms])

    control.solve(on_model=take)
    return found[-1] if found else None


def _words(task: PlanningTask, identifier: str) -> str:
    if identifier == AVOIDED:
        return f"it would bring about {' or '.join(map(str, task.avoided))}"
    return next(
        (each.words or str(each) for each in task.description.axioms_of(identifier)), identifier
    )
