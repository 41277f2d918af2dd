"""Why there is no plan: what would have to be different for one.

If actions may be done though the domain says they are impossible, the plan that does so least often
shows what stands in the way. If not even that leads to the goal, no action brings it about.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from ros_scenesense.knowledge.axioms import ExecutabilityCondition
from ros_scenesense.knowledge.description import GoalCondition, Quantity
from ros_scenesense.knowledge.literals import Atom
from ros_scenesense.knowledge.transition_program import AVOIDED
from ros_scenesense.reasoning.planning import Aim, PlanningLimits, PlanningTask, PlanOutcome, plan


@dataclass(frozen=True)
class Obstacle:
    """What makes an action impossible.

    Attributes:
        action: The action.
        step: When it would be done.
        reason: The statement of the domain that forbids it, in words where it has some.
    """

    action: Atom
    step: int
    reason: str

    def __str__(self) -> str:
        return f"{self.action} at step {self.step}: {self.reason}"


@dataclass(frozen=True)
class Obstacles:
    """What stands in the way of a goal; both are empty if that was not found in time.

    Attributes:
        blocked: What the plan that violates least violates.
        unreachable: The conditions of the goal that no action brings about.
    """

    blocked: tuple[Obstacle, ...] = ()
    unreachable: tuple[GoalCondition, ...] = ()

    def __str__(self) -> str:
        if self.unreachable:
            return f"no action brings about {' or '.join(map(str, self.unreachable))}"
        return "; ".join(map(str, self.blocked))


def obstacles(task: PlanningTask, time_limit_s: float = 3.0, max_steps: int = 8) -> Obstacles:
    """Looks for what stands in the way of a goal that has no plan.

    Args:
        task: As it was given to the planner.
        time_limit_s: For each of at most two searches per condition of the goal.
        max_steps: Longest plans that are looked at.

    Raises:
        ReasoningError: If the solver fails.
    """
    limits = PlanningLimits(
        Aim.OPTIMAL, max_steps=max_steps, slack=max_steps, time_limit_s=time_limit_s
    )
    lenient = replace(task, lenient=True, forbidden=())
    found = plan(lenient, limits)
    if found.plans:
        best = found.plans[0]
        blocked = (
            Obstacle(best.actions[step - 1], step - 1, _reason(task, identifier))
            for identifier, step in best.violations
        )
        return Obstacles(blocked=tuple(dict.fromkeys(blocked)))
    return Obstacles(unreachable=tuple(_unreachable(lenient, limits)))


def _unreachable(task: PlanningTask, limits: PlanningLimits) -> Iterator[GoalCondition]:
    for condition in task.goal.conditions:
        if condition.quantity is not Quantity.FEWEST:
            alone = replace(task, goal=replace(task.goal, conditions=(condition,)))
            if plan(alone, limits).outcome is PlanOutcome.NO_PLAN:
                yield condition


def _reason(task: PlanningTask, identifier: str) -> str:
    if identifier == AVOIDED:
        return f"it would bring about {' or '.join(map(str, task.avoided))}"
    for axiom in task.description.axioms_of(identifier):
        if isinstance(axiom, ExecutabilityCondition):
            return axiom.words or str(axiom)
    return identifier
