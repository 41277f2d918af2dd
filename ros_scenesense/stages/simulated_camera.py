"""The simulated RGB-D camera: shows scenes, paces itself by the estimates, gives none up silently.

At most `in_flight` scenes wait for their estimates. A scene whose estimate does not come is shown
again with the same `scene_id`, and reported as lost after the last attempt. While an episode is
open nothing new is shown but the effects of the robot's actions.
"""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ros_scenesense.errors import ParameterError
from ros_scenesense.messages.actions import Action, Goal, Plan
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.scenes import Labels, Scene, SceneLost
from ros_scenesense.simulation.engine import SimulatedScene
from ros_scenesense.simulation.scene_files import read_scenes
from ros_scenesense.stages.camera_engine import (
    CameraEngine,
    PlayingEngine,
    SimulatedCameraConfiguration,
)
from ros_scenesense.stages.episodes import Episodes, Place
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import Incoming, Job, JobFailure, Outgoing, Timing
from ros_scenesense.stages.scene_ledger import SceneLedger
from ros_scenesense.stages.sessions import new_session
from ros_scenesense.stages.state_file import state_path
from ros_scenesense.stages.withholding import withhold

_LOST_SAID_AGAIN = 100

__all__ = ["SimulatedCameraConfiguration", "SimulatedCameraStage"]


@dataclass
class _Shown:
    messages: list[Outgoing]
    shown_ns: int
    attempts: int


class SimulatedCameraStage:
    """Shows simulated scenes with their labels, and the effects of actions in them.

    Attributes:
        audience: Whether somebody takes the images; nothing is shown before. Nodes set it.
        session: First part of the scene ids.

    Raises:
        DatasetError: If a dataset is to be shown, and the folder is none.
        SimulationError: If scene files are to be shown, and one is missing or wrong.
        ParameterError: If both are to be shown.
        StateError: If camera.db cannot be used.
    """

    def __init__(self, configuration: SimulatedCameraConfiguration) -> None:
        self.configuration = configuration
        self.health = Health()
        self.audience = True
        self._last_stamp_ns = 0
        self._ledger = SceneLedger(state_path(configuration.state_dir, "camera.db"), self.health)
        self._dataset = Path(configuration.dataset).expanduser() if configuration.dataset else None
        self._length = _length_of(configuration)
        self._episodes = Episodes(
            self._ledger,
            configuration.seed,
            configuration.episode_timeout_s,
            self.health,
            playing=self._dataset is not None,
        )
        self._begin(configuration.session or new_session())

    def engine(self) -> Callable[[], Any] | None:
        """A factory of the simulation, or of the reader of a dataset."""
        if self._dataset is not None:
            return partial(PlayingEngine, self._dataset, self.configuration.noise)
        return partial(CameraEngine, self.configuration)

    def start(self, now_ns: int) -> list[Outgoing]:
        """Goes on with the episode of before; says which scenes of before are lost.

        Whoever was killed while it said so has not been heard, and what it said is forgotten.
        """
        if self._last is not None and self._ledger.step(self.session, self._last) is not None:
            self._episodes.open(now_ns)
        lost = [
            (_id(session, number), "the camera was started again, with a new session")
            for session, number in self._ledger.give_up_others(self.session)
        ]
        self.health.count("scenes_lost", len(lost))
        lost += [
            (self._scene_id(number), "it was given up before the camera was started again")
            for number in self._ledger.lost_scenes(self.session, _LOST_SAID_AGAIN)
        ]
        stamp = Stamp.of(now_ns)
        return [
            SceneLost(stamp=stamp, scene_id=scene_id, attempts=0, reason=reason)
            for scene_id, reason in lost
        ]

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes `estimates`: the scene is settled. Takes `action`: it is executed or refused.

        From a `goal` on, the camera shows nothing new but the effects of actions, until a `plan`
        says what became of it.

        After a restart estimates may come (latched) before the scene is shown again.
        """
        if isinstance(item, Action):
            return [*self._episodes.take(item, self._shown_last(), now_ns)]
        if isinstance(item, Goal):
            self._episodes.hold(item, now_ns)
        if isinstance(item, Plan):
            self._episodes.release(item, self._shown_last())
        if not isinstance(item, Estimates):
            return []
        number = self._number(item.scene_id)
        if number is None or number not in self._open_numbers():
            self.health.count("estimates_not_awaited")
            return []
        shown = self._shown.get(number)
        self._forget(number)
        self._ledger.record(self.session, number, "settled")
        self.health.count("scenes_settled")
        timing: list[Outgoing] = []
        if shown is not None:
            timing = [Timing("simulated_camera/round_trip", (now_ns - shown.shown_ns) / 1e6)]
        return timing + self._show_rendered(now_ns)

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Shows again what was not answered; gives up after the last attempt."""
        self._episodes.tick(now_ns)
        outgoing = self._show_rendered(now_ns)
        for number, shown in list(self._shown.items()):
            if now_ns - shown.shown_ns <= self.configuration.resend_s * 1e9:
                continue
            if shown.attempts >= self.configuration.attempts:
                del self._shown[number]
                outgoing.append(self._lose(number, shown.attempts, "no estimate came", now_ns))
                continue
            shown.attempts += 1
            outgoing += self._repeat(shown, now_ns)
        return outgoing

    def show_again(self, now_ns: int) -> list[Outgoing]:
        """Shows at once what waits for its estimates: somebody new may have missed it.

        A node that was restarted would else wait until the time for the next attempt has come.
        """
        return [item for shown in self._shown.values() for item in self._repeat(shown, now_ns)]

    def jobs(self) -> list[Job]:
        """The action that is to be executed; rendering of as many scenes as may be under way."""
        jobs = self._episodes.jobs()
        while (
            len(self._rendering) + len(self._rendered) + len(self._shown)
            < self.configuration.in_flight
        ):
            number = self._next_number()
            if number is None:
                break
            self._ledger.record(self.session, number, "open")
            self._rendering.add(number)
            jobs.append(self._rendering_job(number))
        return jobs

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """Takes a rendered scene, or the effect of an action; shows it once somebody looks."""
        if job.method == "act":
            return self._acted(job, result, now_ns)
        number = self._number(job.key)
        if (
            number is None or number not in self._rendering
        ):  # a leftover of the session before a reset
            return []
        self._rendering.remove(number)
        if isinstance(result, JobFailure):
            return self._render_failed(number, result, now_ns)
        scene, seconds = result
        self._failures.pop(number, None)
        self._rendered.append((number, scene))
        return [
            Timing("simulated_camera/render", seconds * 1e3),
            *self._show_rendered(now_ns),
        ]

    def next_scene(self, now_ns: int) -> list[Outgoing]:
        """Asks for one more scene than the camera would show by itself; ends an episode."""
        del now_ns
        self._episodes.close()
        self._asked += 1
        return []

    def reset(self, now_ns: int) -> list[Outgoing]:
        """Begins a new session at scene 0; the open scenes of the old one are lost."""
        lost: list[Outgoing] = [*self._episodes.abandon("the camera was reset")]
        for number in sorted(self._open_numbers()):
            attempts = self._shown[number].attempts if number in self._shown else 0
            lost.append(self._lose(number, attempts, "the camera was reset", now_ns))
        self._begin(new_session())
        return lost

    def close(self) -> None:
        """Closes camera.db."""
        self._ledger.close()

    def _begin(self, session: str) -> None:
        self.session = session
        self._unfinished = deque(self._ledger.open_scenes(session))
        self._fresh = self._ledger.next_number(session)
        self._last = self._fresh - 1 if self._fresh else None
        self._asked = 0
        self._rendering: set[int] = set()
        self._failures: dict[int, int] = {}
        self._rendered: deque[tuple[int, SimulatedScene]] = deque()
        self._shown: dict[int, _Shown] = {}

    def _open_numbers(self) -> set[int]:
        rendered = {number for number, _ in self._rendered}
        return {*self._unfinished, *self._rendering, *rendered, *self._shown}

    def _forget(self, number: int) -> None:
        self._shown.pop(number, None)
        self._rendering.discard(number)
        self._rendered = deque(pair for pair in self._rendered if pair[0] != number)
        self._unfinished = deque(other for other in self._unfinished if other != number)

    def _next_number(self) -> int | None:
        if self._unfinished:
            return self._unfinished.popleft()
        if self._fresh >= self._length:
            return None
        limit = self.configuration.scenes
        by_itself = self.configuration.autostart and not self._episodes.is_open
        wanted = self._asked > 0 or (by_itself and (limit == 0 or self._fresh < limit))
        if not wanted:
            return None
        self._asked = max(0, self._asked - 1)
        self._fresh += 1
        return self._fresh - 1

    def _rendering_job(self, number: int) -> Job:
        story = self._episodes.story(self.session, number)
        if story.actions:
            return Job(self._scene_id(number), "replay", (story,))
        return Job(self._scene_id(number), "scene", (self.configuration.seed, number))

    def _acted(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        answers, scene = self._episodes.finish(job, result, self._fresh, now_ns)
        if scene is None:
            return [*answers]
        self._rendered.append((self._fresh, scene))
        self._fresh += 1
        timing = Timing("simulated_camera/act", result[2] * 1e3)
        return [*answers, timing, *self._show_rendered(now_ns)]

    def _shown_last(self) -> Place | None:
        if self._last is None:
            return None
        return Place(self.session, self._last, self._scene_id(self._last))

    def _show_rendered(self, now_ns: int) -> list[Outgoing]:
        outgoing: list[Outgoing] = []
        for number, scene in list(self._rendered):
            step = self._ledger.step(self.session, number)
            if not self.audience or (step is None and self._episodes.is_open):
                continue
            self._rendered.remove((number, scene))
            # Two scenes of one session must never share a stamp: images are joined on it.
            self._last_stamp_ns = max(now_ns, self._last_stamp_ns + 1)
            messages = self._messages(number, scene, self._last_stamp_ns)
            self._shown[number] = _Shown(messages, now_ns, attempts=1)
            self._last = number
            self.health.count("scenes_shown")
            outgoing.extend(messages)
        return outgoing

    def _repeat(self, shown: _Shown, now_ns: int) -> list[Outgoing]:
        shown.shown_ns = now_ns
        self.health.count("scenes_shown_again")
        return shown.messages

    def _messages(self, number: int, scene: SimulatedScene, stamp_ns: int) -> list[Outgoing]:
        stamp = Stamp.of(stamp_ns)
        scene_id = self._scene_id(number)
        training = self.configuration.mode == "training"
        step = self._ledger.step(self.session, number)
        story = self._episodes.story(self.session, number)
        share = self.configuration.withheld_attributes
        return [
            Scene(
                stamp=stamp,
                scene_id=scene_id,
                mode="training" if training else "testing",
                objects=withhold(scene.objects, share, story.seed, story.index),
                camera_pose=scene.frame.camera_pose,
                episode_id=step.episode_id if step is not None else None,
                step=step.count if step is not None else 0,
                in_hand=story.in_hand,
            ),
            Labels(
                stamp=stamp,
                scene_id=scene_id,
                use="train" if training else "evaluate",
                objects=scene.object_labels,
                structures=scene.structure_labels,
            ),
            dataclasses.replace(scene.frame, stamp_ns=stamp_ns),
        ]

    def _render_failed(self, number: int, failure: JobFailure, now_ns: int) -> list[Outgoing]:
        failures = self._failures.pop(number, 0) + 1
        self.health.problem(
            "render_failed", f"scene {self._scene_id(number)} was not rendered: {failure.reason}"
        )
        if failures >= self.configuration.attempts:
            return [self._lose(number, 0, failure.reason, now_ns)]
        self._failures[number] = failures
        self._unfinished.append(number)
        return []

    def _lose(self, number: int, attempts: int, reason: str, now_ns: int) -> SceneLost:
        scene_id = self._scene_id(number)
        self._ledger.record(self.session, number, "lost")
        self.health.problem("scenes_lost", f"scene {scene_id} is lost: {reason}")
        return SceneLost(
            stamp=Stamp.of(now_ns), scene_id=scene_id, attempts=attempts, reason=reason
        )

    def _scene_id(self, number: int) -> str:
        return _id(self.session, number)

    def _number(self, scene_id: str) -> int | None:
        session, _, number = scene_id.rpartition("-")
        if session != self.session or not number.isdecimal():
            return None
        return int(number)


def _id(session: str, number: int) -> str:
    return f"{session}-{number:04d}"


def _length_of(configuration: SimulatedCameraConfiguration) -> float:
    """How many scenes there are to show."""
    if configuration.dataset and configuration.scene_files:
        raise ParameterError(
            "parameters 'dataset' and 'scene_files' are both set: leave out one of them"
        )
    if configuration.scene_files:
        return len(read_scenes(Path(configuration.scene_files).expanduser()))
    if not configuration.dataset:
        return math.inf
    # A camera that simulates needs nothing of this.
    from ros_scenesense.simulation.dataset.folder import DatasetFolder

    return DatasetFolder(Path(configuration.dataset).expanduser()).read_metadata().count
