"""The work of planning and diagnosis, in a worker process: grounding cannot be interrupted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from ros_scenesense.knowledge.description import Happened, History, Observation
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.reasoning.described_scenes import TABLE
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
from ros_scenesense.reasoning.purposes import Purpose, purposes
from ros_scenesense.reasoning.situations import Situation


@dataclass(frozen=True)
class PlanReport:
    """The answer to a planning task.

    Attributes:
        planning: The plans.
        obstacles: Why there is none; None if there is one.
        purposes: What each action of the best plan is for, if that was asked.
    """

    planning: Planning
    obstacles: Obstacles | None = None
    purposes: tuple[Purpose, ...] = ()


@dataclass(frozen=True)
class OutcomeReport:
    """What an action has led to.

    Attributes:
        before: What held before.
        expected: What should hold after it.
        after: What was seen to hold after it.
        surprises: What was seen, where something else was expected; false literals where an
            expected one was not seen to hold.
        diagnosis: What must have happened; None where all was expected.
    """

    before: State
    expected: State
    after: State
    surprises: tuple[Literal, ...] = ()
    diagnosis: Diagnosis | None = None


class PlanningEngine:
    """Plans, and explains what came otherwise than planned. Remembers nothing between two calls."""

    def plan(self, task: PlanningTask, limits: PlanningLimits) -> PlanReport:
        """Plans; if there is no plan, looks for what stands in its way.

        Args:
            task: Where to start, and what to achieve.
            limits: What to look for, and for how long.

        Raises:
            ReasoningError: If the solver fails.
        """
        planning = plan(task, limits)
        if planning.outcome is PlanOutcome.NO_PLAN:
            return PlanReport(planning, obstacles(task, limits.time_limit_s))
        return PlanReport(planning)

    def plan_with_purposes(self, task: PlanningTask, limits: PlanningLimits) -> PlanReport:
        """The same, and what each action of the best plan is for.

        Raises:
            ReasoningError: If the solver fails.
        """
        report = self.plan(task, limits)
        if not report.planning.plans:
            return report
        actions = report.planning.plans[0].actions
        return replace(report, purposes=purposes(task, actions))

    def expect(self, before: Situation, action: Atom) -> OutcomeReport:
        """What should have come of an action that was refused, so that nothing has changed.

        Raises:
            ReasoningError: If the solver fails, or the scene contradicts the domain.
        """
        held, expected = project(before.description, before.initial, [action], _watched(before))
        return OutcomeReport(held, expected, held)

    def observe(
        self, before: Situation, action: Atom, after: Situation, time_limit_s: float
    ) -> OutcomeReport:
        """Compares what is seen after an action with what should be, and explains the difference.

        What is compared is what stands on what, of the objects that are located before and after
        the action, and what is in the hand.

        Args:
            before: The scene that the robot acted in.
            action: What it did.
            after: The scene that shows the effect.
            time_limit_s: For the diagnosis.

        Raises:
            ReasoningError: If the solver fails, or a scene contradicts the domain.
        """
        watched = _watched(before)
        held, expected = project(before.description, before.initial, [action], watched)
        (seen,) = project(after.description, after.initial, [], watched)
        observations = tuple(
            Observation(atom, Literal(atom) in seen, 1) for atom in _compared(before, after)
        )
        surprises = tuple(
            Literal(each.fluent, each.value)
            for each in observations
            if (Literal(each.fluent) in expected) is not each.value
        )
        diagnosis = None
        if surprises:
            history = History(observations, (Happened(action, 0),), before.initial)
            diagnosis = diagnose(before.description, history, time_limit_s)
        return OutcomeReport(held, expected, seen, surprises, diagnosis)


def _watched(situation: Situation) -> list[str]:
    """The names of all fluents."""
    attributes = situation.description.signature.attributes.values()
    return [each.name for each in attributes if each.kind is not AttributeKind.STATIC]


def _compared(before: Situation, after: Situation) -> Iterator[Atom]:
    members = before.description.signature.members("object")
    common = [each for each in after.objects if each in members]
    for upper in common:
        for lower in (*common, Constant(TABLE)):
            if upper != lower:
                yield Atom("on", (upper, lower))
    for each in members:
        yield Atom("in_hand", (before.robot, each))
