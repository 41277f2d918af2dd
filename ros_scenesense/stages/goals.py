"""Pursues a person's goal: plans, asks for one action at a time, looks what came of it, replans.

What an action has led to is seen in the relations of the next scene, never told by the simulator.
Where it is not what was expected, a diagnosis says what must have happened, and a new plan starts
from what was seen.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import Any, Literal

import msgspec

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.messages.actions import (
    Action,
    ActionResult,
    Goal,
    Plan,
    PlannedAction,
    Transition,
)
from ros_scenesense.messages.base import Stamp
from ros_scenesense.reasoning.planning import PlanningLimits, PlanOutcome
from ros_scenesense.stages.goal_ledger import GoalLedger, OpenGoal
from ros_scenesense.stages.goal_words import literals_of, unexpected, words_of
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.planning_engine import OutcomeReport, PlanReport
from ros_scenesense.stages.protocol import Job, JobFailure, Outgoing, Timing
from ros_scenesense.stages.seen_scenes import SeenScene, SeenScenes

Ending = Literal["reached", "no_plan", "refused", "timed_out", "failed"]

_LONGEST_REASON = 4000
# What cannot be interrupted, grounding, may take so much longer than searching.
_GRACE_S = 10.0


@dataclass(frozen=True)
class GoalLimits:
    """How much is done for a goal.

    Attributes:
        time_limit_s: Seconds to search for one plan.
        max_steps: Longest plans.
        plans: Plans that are made for one goal.
        patience_s: Seconds to wait for a scene, or for the answer to an action.
    """

    time_limit_s: float
    max_steps: int
    plans: int
    patience_s: float


class GoalKeeper:
    """Pursues one goal at a time.

    Args:
        ledger: Remembers the open goal.
        limits: How much is done for it.
        health: Counts what was done.
    """

    def __init__(self, ledger: GoalLedger, limits: GoalLimits, health: Health) -> None:
        self._ledger = ledger
        self._limits = limits
        self._health = health
        self._goal: OpenGoal | None = ledger.open_goal()
        self._scenes = SeenScenes()
        self._wanted: str | None = None
        self._plan: list[PlannedAction] = []
        self._reason = ""
        self._refused: dict[str, list[tuple[PlannedAction, str]]] = {}
        self._job: Job | None = None
        self._running: str | None = None
        # The action that was refused, while it is worked out what should have come of it.
        self._declined: Action | None = None
        # What was known when the plan was made.
        self._known: tuple[SystemDescription, frozenset[str]] | None = None
        # The scene that is planned in, or that shows the effect of the action.
        self._here: SeenScene | None = None
        self._number = 0
        self._since_ns: int | None = None

    def start(self, now_ns: int) -> list[Outgoing]:
        """Goes on with the goal of before: asks again for the action that was under way."""
        self._since_ns = now_ns
        if self._goal is None or self._goal.pending is None or self._goal.observing:
            return []
        return [self._goal.pending]

    def take_goal(self, goal: Goal, now_ns: int) -> list[Outgoing]:
        """Takes a goal that somebody published."""
        newest = self._scenes.newest
        scene_id = newest.id if newest is not None else ""
        identifier = goal.id or f"goal-{_digest(goal.goal, scene_id)}"
        if self._goal is not None:
            same = goal.id == self._goal.id if goal.id else goal.goal == self._goal.text
            if same:
                self._health.count("goals_repeated")
                return []
        elif self._ledger.knows(identifier):
            self._health.count("goals_repeated")
            return []
        taken = OpenGoal(identifier, goal.goal, goal.stamp or Stamp.of(now_ns))
        if self._goal is not None:
            words = f"goal {self._goal.text!r} is being pursued: wait for the last plan about it"
            return [self._answer(taken, "refused", words)]
        self._health.count("goals_taken")
        self._goal = taken
        self._ledger.keep(taken)
        self._forget(now_ns)
        return self._make_plan(newest, now_ns) if newest is not None else []

    def take_scene(self, seen: SeenScene, now_ns: int) -> list[Outgoing]:
        """Takes a scene that was just decided."""
        self._scenes.add(seen)
        goal = self._goal
        if goal is None or self._running is not None:
            return []
        if goal.pending is not None:
            return self._look_at(seen, goal.pending, now_ns) if goal.observing else []
        if self._wanted is None or self._scenes.get(self._wanted) is not None:
            return self._make_plan(seen, now_ns)
        return []

    def take_result(self, result: ActionResult, now_ns: int) -> list[Outgoing]:
        """Takes the answer to an action."""
        goal = self._goal
        if goal is None or goal.pending is None or goal.observing:
            return []
        action = goal.pending
        if (result.id, result.scene_id) != (action.id, action.scene_id):
            return []
        self._since_ns = now_ns
        if result.outcome == "executed":
            self._health.count("actions_executed")
            goal.observing = True
            self._ledger.keep(goal)
            seen = self._scenes.effect_of(action)
            return [] if seen is None else self._look_at(seen, action, now_ns)
        goal.pending = None
        self._ledger.keep(goal)
        self._plan = []
        if result.shown is not None:
            # The camera showed another scene meanwhile; plan there.
            self._wanted, self._reason = result.shown, result.reason
            moved_on = self._scenes.get(result.shown)
            return [] if moved_on is None else self._make_plan(moved_on, now_ns)
        self._health.count("actions_refused")
        self._refused.setdefault(action.scene_id, []).append((action.action, result.reason))
        self._reason = f"{words_of(action.action)} was refused: {result.reason}"
        seen_before = self._scenes.get(action.scene_id)
        if seen_before is None:
            return []
        self._here, self._declined = seen_before, action
        situation = self._scenes.situation(seen_before)
        self._submit("expect", (situation, situation.action(action.action)))
        return []

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Gives a goal up when nothing comes any more."""
        if self._goal is None or self._running is not None or self._since_ns is None:
            return []
        waited_s = (now_ns - self._since_ns) / 1e9
        if waited_s <= self._limits.patience_s:
            return []
        goal = self._goal
        if goal.pending is not None and not goal.observing:
            missing = "the answer to an action (from the camera or a robot)"
        elif goal.pending is not None:
            missing = "the scene that shows the effect of an action (from the camera)"
        else:
            missing = f"scene {self._wanted}" if self._wanted else "a scene to plan in"
        words = f"{missing} did not come within {self._limits.patience_s:g} s"
        return self._end("failed", words)

    def jobs(self) -> list[Job]:
        """The plan or the comparison that is to be made."""
        job, self._job = self._job, None
        return [] if job is None else [job]

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """Takes a plan, or what an action has led to."""
        here = self._here
        if job.key != self._running or self._goal is None or here is None:
            return []
        self._running = None
        self._since_ns = now_ns
        declined, self._declined = self._declined, None
        if declined is not None:
            told = [] if isinstance(result, JobFailure) else self._told(declined, here, result)
            return [*told, *self._make_plan(here, now_ns)]
        if isinstance(result, JobFailure):
            return self._end("timed_out" if result.timed_out else "failed", result.reason)
        if isinstance(result, PlanReport):
            return self._planned(here, result)
        return self._observed(here, result, now_ns)

    def close(self) -> None:
        """Closes the ledger."""
        self._ledger.close()

    def _forget(self, now_ns: int) -> None:
        self._wanted, self._plan, self._reason, self._refused = None, [], "", {}
        self._job, self._running, self._since_ns = None, None, now_ns
        self._declined = None

    def _submit(self, method: str, arguments: tuple[Any, ...]) -> None:
        self._number += 1
        deadline_s = 3 * self._limits.time_limit_s + _GRACE_S
        self._job = Job(f"goal {self._number}", method, arguments, deadline_s)
        self._running = self._job.key

    def _make_plan(self, seen: SeenScene, now_ns: int) -> list[Outgoing]:
        """Has a plan made that starts in this scene."""
        goal = self._goal
        assert goal is not None
        self._since_ns = now_ns
        self._wanted, self._here = None, seen
        self._known = (seen.domain, seen.withheld)
        if goal.plans >= self._limits.plans:
            words = f"the goal was not reached by {goal.plans} plans; last: {self._reason}"
            return self._end("failed", words)
        situation = self._scenes.situation(seen)
        try:
            wanted = situation.goal(goal.text)
        except LanguageError as error:
            return self._end("refused", str(error))
        goal.plans += 1
        self._ledger.keep(goal)
        refused = self._refused.get(seen.id, ())
        task = replace(
            situation.task(wanted),
            forbidden=tuple(situation.action(action) for action, _ in refused),
        )
        limits = PlanningLimits(
            max_steps=self._limits.max_steps, time_limit_s=self._limits.time_limit_s
        )
        self._submit("plan_with_purposes", (task, limits))
        return []

    def _planned(self, seen: SeenScene, report: PlanReport) -> list[Outgoing]:
        goal = self._goal
        assert goal is not None
        planning = report.planning
        timing = Timing("reasoner/plan", planning.seconds * 1e3)
        if planning.outcome is PlanOutcome.REACHED:
            return [timing, *self._end("reached", "")]
        if planning.outcome is PlanOutcome.TIMED_OUT:
            words = f"no plan was found within {self._limits.time_limit_s:g} s"
            return [timing, *self._end("timed_out", words)]
        if planning.outcome is PlanOutcome.NO_PLAN:
            reasons = [f"there is no plan up to step {planning.steps}"]
            reasons += [str(report.obstacles)] if report.obstacles is not None else []
            reasons += [
                f"refused was {words_of(action)}: {reason}"
                for action, reason in self._refused.get(seen.id, ())
            ]
            return [timing, *self._end("no_plan", "; ".join(filter(None, reasons)))]
        situation = self._scenes.situation(seen)
        self._plan = list(map(situation.planned, planning.plans[0].actions))
        plan = self._message(goal, seen.id, "found", self._reason, self._plan)
        plan = msgspec.structs.replace(plan, purposes=list(map(str, report.purposes)))
        self._reason = ""
        self._health.count("plans_made")
        return [timing, plan, *self._next_action(seen)]

    def _next_action(self, seen: SeenScene) -> list[Outgoing]:
        goal = self._goal
        assert goal is not None
        planned = self._plan.pop(0)
        goal.asked += 1
        goal.pending = Action(
            stamp=seen.scene.stamp,
            scene_id=seen.id,
            id=f"{_digest(goal.id)}-{goal.asked}",
            episode_id=goal.id,
            step=seen.scene.step if seen.scene.episode_id == goal.id else 0,
            action=planned,
        )
        goal.observing = False
        self._ledger.keep(goal)
        return [goal.pending]

    def _look_at(self, seen: SeenScene, action: Action, now_ns: int) -> list[Outgoing]:
        """Has the scene that shows the effect of an action compared with what was expected."""
        if not seen.shows_effect_of(action):
            return []
        before = self._scenes.get(action.scene_id)
        self._here = seen
        if before is None:
            # It was seen before a restart, too long ago.
            self._settle()
            return self._make_plan(seen, now_ns)
        situation = self._scenes.situation(before)
        arguments = (
            situation,
            situation.action(action.action),
            self._scenes.situation(seen),
            self._limits.time_limit_s,
        )
        self._submit("observe", arguments)
        return []

    def _settle(self) -> None:
        assert self._goal is not None
        self._goal.pending, self._goal.observing = None, False
        self._ledger.keep(self._goal)

    def _observed(self, seen: SeenScene, report: OutcomeReport, now_ns: int) -> list[Outgoing]:
        goal = self._goal
        assert goal is not None
        action = goal.pending
        assert action is not None
        told = self._told(action, seen, report)
        self._reason = unexpected(action, report)
        for each in told:
            self._ledger.record(goal.id, each, self._reason)
        self._settle()
        if report.surprises:
            self._health.count("outcomes_unexpected")
            self._plan = []
        elif self._plan and (seen.domain, seen.withheld) != self._known:
            self._reason, self._plan = "what the robot knows has changed", []
        elif not self._plan:
            self._reason = "all of the plan was done, and the goal does not hold yet"
        if self._plan:
            return [*told, *self._next_action(seen)]
        return [*told, *self._make_plan(seen, now_ns)]

    def _told(self, action: Action, seen: SeenScene, report: OutcomeReport) -> list[Transition]:
        """What came of an action, for whoever learns from it; nothing if it is forgotten."""
        before = self._scenes.get(action.scene_id)
        if before is None:
            return []
        there, here = self._scenes.situation(before), self._scenes.situation(seen)
        return [
            Transition(
                stamp=seen.scene.stamp,
                id=action.id,
                episode_id=action.episode_id,
                step=action.step,
                scene_before=action.scene_id,
                scene_after=seen.id,
                action=action.action,
                before=literals_of(report.before.union(there.description.facts), there),
                after=literals_of(report.after, here),
                expected=literals_of(report.expected, there),
                outcome="refused" if seen is before else "executed",
            )
        ]

    def _end(self, outcome: Ending, reason: str) -> list[Outgoing]:
        goal = self._goal
        assert goal is not None
        self._ledger.close_goal(goal.id, outcome)
        self._goal = None
        self._job, self._running, self._declined = None, None, None
        self._health.count(f"goals_{outcome}")
        return [self._answer(goal, outcome, reason)]

    def _answer(self, goal: OpenGoal, outcome: Ending, reason: str) -> Plan:
        newest = self._scenes.newest
        scene_id = newest.id if newest is not None else "unknown"
        return self._message(goal, scene_id, outcome, reason, [])

    def _message(
        self,
        goal: OpenGoal,
        scene_id: str,
        outcome: Literal["found"] | Ending,
        reason: str,
        actions: list[PlannedAction],
    ) -> Plan:
        return Plan(
            stamp=goal.stamp,
            scene_id=scene_id,
            id=goal.id,
            goal=goal.text,
            outcome=outcome,
            actions=list(actions),
            reason=reason[:_LONGEST_REASON],
        )


def _digest(*texts: str) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16]
