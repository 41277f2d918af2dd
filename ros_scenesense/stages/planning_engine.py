"""The work of planning and diagnosis, in a worker process: grounding cannot be interrupted."""

from __future__ import annotations

from dataclasses import dataclass

from ros_scenesense.knowledge.description import History, SystemDescription
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.reasoning.diagnosis import Diagnosis, diagnose
from ros_scenesense.reasoning.obstacles import Obstacles, obstacles
from ros_scenesense.reasoning.planning import (
    Planning,
    PlanningLimits,
    PlanningTask,
    PlanOutcome,
    plan,
)
from ros_scenesense.reasoning.projection import State, project


@dataclass(frozen=True)
class PlanReport:
    """The answer to a planning task.

    Attributes:
        planning: The plans.
        obstacles: Why there is none; None if there is one.
        states: What holds before the best plan and after each of its actions.
    """

    planning: Planning
    obstacles: Obstacles | None = None
    states: tuple[State, ...] = ()


class PlanningEngine:
    """Plans, and explains what came otherwise than planned. Remembers nothing between two calls."""

    def plan(
        self, task: PlanningTask, limits: PlanningLimits, watched: tuple[str, ...] = ()
    ) -> PlanReport:
        """Plans; if there is no plan, looks for what stands in its way.

        Args:
            task: Where to start, and what to achieve.
            limits: What to look for, and for how long.
            watched: The fluents of the states that the best plan leads through.

        Raises:
            ReasoningError: If the solver fails.
        """
        planning = plan(task, limits)
        if planning.outcome is PlanOutcome.NO_PLAN:
            return PlanReport(planning, obstacles(task, limits.time_limit_s))
        if not planning.plans or not watched:
            return PlanReport(planning)
        actions = planning.plans[0].actions
        return PlanReport(
            planning, states=project(task.description, task.initial, actions, watched)
        )

    def diagnose(
        self, description: SystemDescription, history: History, time_limit_s: float
    ) -> Diagnosis:
        """Explains a history by what happened without the robot.

        Raises:
            ReasoningError: If the solver fails.
        """
        return diagnose(description, history, time_limit_s)

    def project(
        self,
        description: SystemDescription,
        initial: tuple[Literal, ...],
        actions: tuple[Atom, ...],
        watched: tuple[str, ...],
    ) -> tuple[State, ...]:
        """The states that follow from what is true at first and what the robot does.

        Raises:
            ReasoningError: If there are none, or the solver fails.
        """
        return project(description, initial, actions, watched)
