"""The robot's actions in the simulated world: which are executed, and what was answered.

While an episode is open the camera does not go on by itself: the next scene is the effect of the
next action. An action is known by its id and its scene, and answered the same way every time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from ros_scenesense.messages.actions import Action, ActionResult, Goal, Plan
from ros_scenesense.simulation.engine import SimulatedScene
from ros_scenesense.simulation.episodes import Story
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import Job, JobFailure
from ros_scenesense.stages.scene_ledger import EpisodeStep, SceneLedger

if TYPE_CHECKING:
    from ros_scenesense.simulation.actions import ActionOutcome


@dataclass(frozen=True)
class Place:
    """The scene that an action may be about.

    Attributes:
        session: First part of its id.
        number: Its number in the session.
        scene_id: Its id.
    """

    session: str
    number: int
    scene_id: str


class Episodes:
    """Takes actions one at a time.

    Args:
        ledger: Remembers the answers, and what was done.
        seed: Seed of all scenes.
        timeout_s: An episode is over when no action came for so long.
        health: Counts what was executed, refused, repeated.
        playing: Whether the scenes are recorded ones, in which nobody can act.
    """

    def __init__(
        self, ledger: SceneLedger, seed: int, timeout_s: float, health: Health, playing: bool
    ) -> None:
        self._ledger = ledger
        self._seed = seed
        self._timeout_s = timeout_s
        self._health = health
        self._playing = playing
        self._active_ns: int | None = None
        self._goal: str | None = None
        self._pending: tuple[Action, Place] | None = None
        self._submitted = False

    @property
    def is_open(self) -> bool:
        """Whether the camera waits for the next action."""
        return self._active_ns is not None

    def open(self, now_ns: int) -> None:
        """The camera waits from now on."""
        self._active_ns = now_ns

    def close(self) -> None:
        """The camera waits no longer."""
        self._active_ns = None
        self._goal = None

    def hold(self, goal: Goal, now_ns: int) -> None:
        """The camera waits for the actions that somebody's goal will ask for."""
        if not self._playing and goal.goal != self._goal:
            self._health.count("goals_heard")
            self._goal = goal.goal
            self.open(now_ns)

    def release(self, plan: Plan, shown: Place | None) -> None:
        """The camera waits no longer if this is the last word on the goal of the episode."""
        if plan.outcome == "found" or self._pending is not None:
            return
        step = None if shown is None else self._ledger.step(shown.session, shown.number)
        if plan.goal == self._goal or (step is not None and step.episode_id == plan.id):
            self.close()

    def tick(self, now_ns: int) -> None:
        """Ends an episode in which nothing happens any more."""
        if self._active_ns is None or self._pending is not None:
            return
        if now_ns - self._active_ns > self._timeout_s * 1e9:
            self._health.count("episodes_timed_out")
            self.close()

    def take(self, action: Action, shown: Place | None, now_ns: int) -> list[ActionResult]:
        """Takes an action; returns the answer if it is known already.

        Args:
            action: What is asked.
            shown: The scene shown last; None if there is none.
            now_ns: The time.
        """
        if self._pending is not None and _key(self._pending[0]) == _key(action):
            self._health.count("actions_repeated")
            return []
        answer = self._ledger.answer(action.scene_id, action.id)
        if answer is not None:
            self._health.count("actions_repeated")
            return [answer]
        reason = self._objection(action, shown)
        if reason:
            return [self._refuse(action, reason, shown)]
        assert shown is not None
        self.open(now_ns)
        self._pending = (action, shown)
        self._submitted = False
        return []

    def jobs(self) -> list[Job]:
        """The execution of the action that was taken."""
        if self._pending is None or self._submitted:
            return []
        self._submitted = True
        action, place = self._pending
        story = self.story(place.session, place.number)
        return [Job(_key(action), "act", (story, action.action))]

    def finish(
        self, job: Job, result: Any, number: int, now_ns: int
    ) -> tuple[list[ActionResult], SimulatedScene | None]:
        """Takes the result of an execution.

        Args:
            job: The job.
            result: Outcome, scene and seconds, or a `JobFailure`.
            number: Number of the scene that shows the effect, if there is one.
            now_ns: The time.

        Returns:
            The answer, and the scene of the effect; None if the action was refused.
        """
        if self._pending is None or job.key != _key(self._pending[0]):
            return [], None
        action, place = self._pending
        self._pending = None
        if self.is_open:
            self.open(now_ns)
        if isinstance(result, JobFailure):
            return [self._refuse(action, f"it could not be executed: {result.reason}")], None
        outcome: ActionOutcome
        scene: SimulatedScene | None
        outcome, scene, _ = result
        if scene is None:
            return [self._refuse(action, outcome.reason)], None
        answer = _answer(action, "executed")
        before = self._ledger.step(place.session, place.number)
        goes_on = before is not None and before.episode_id == action.episode_id
        count = 1 + (before.count if before is not None and goes_on else 0)
        step = EpisodeStep(place.number, action.episode_id, count, action.action)
        self._ledger.record_step(answer, place.session, number, step)
        self._health.count("actions_executed")
        return [answer], scene

    def abandon(self, reason: str) -> list[ActionResult]:
        """Ends the episode; an action under way is refused."""
        self.close()
        if self._pending is None:
            return []
        action, _ = self._pending
        self._pending = None
        return [self._refuse(action, reason)]

    def story(self, session: str, number: int) -> Story:
        """How a scene came about, from the scene on that the camera showed by itself."""
        actions = []
        while (step := self._ledger.step(session, number)) is not None:
            actions.append(step.action)
            number = step.before
        return Story(self._seed, number, tuple(reversed(actions)))

    def _objection(self, action: Action, shown: Place | None) -> str:
        if self._playing:
            return "a dataset is being played, nobody can act in it: leave out parameter 'dataset'"
        if shown is None:
            return "no scene was shown yet"
        if self._pending is not None:
            return f"action {self._pending[0].id} is being executed"
        if action.scene_id != shown.scene_id:
            return (
                f"scene {action.scene_id} is not the one shown last, which is {shown.scene_id}: "
                "publish a goal first, then the camera waits"
            )
        return ""

    def _refuse(self, action: Action, reason: str, shown: Place | None = None) -> ActionResult:
        answer = _answer(action, "refused", reason)
        if shown is not None and shown.scene_id != action.scene_id:
            answer = msgspec.structs.replace(answer, shown=shown.scene_id)
        self._ledger.record_refusal(answer)
        self._health.count("actions_refused")
        return answer


def _answer(
    action: Action, outcome: Literal["executed", "refused"], reason: str = ""
) -> ActionResult:
    return ActionResult(
        stamp=action.stamp,
        scene_id=action.scene_id,
        id=action.id,
        outcome=outcome,
        # Names that a person wrote may make the reason as long as they like.
        reason=reason[:_LONGEST_REASON],
    )


def _key(action: Action) -> str:
    return f"{action.scene_id} {action.id}"


_LONGEST_REASON = 1000
