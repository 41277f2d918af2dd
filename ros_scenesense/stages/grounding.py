"""Grounding as a stage: joins images with their scene and publishes objects and groundings."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import partial
from typing import Any

from ros_scenesense.errors import FrameError
from ros_scenesense.grounding.msr import MetricSettings
from ros_scenesense.messages.grounding import MsrUpdate
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.scene import Frame
from ros_scenesense.stages.grounding_engine import (
    SELF,
    GroundingConfiguration,
    GroundingEngine,
    GroundingResult,
    instances_of,
    unlocated,
)
from ros_scenesense.stages.grounding_store import GroundingStore
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.join import LATE_COMERS, SceneJoin
from ros_scenesense.stages.own_scenes import OwnScenes, SceneNumbers
from ros_scenesense.stages.pair_grounding import Learned
from ros_scenesense.stages.protocol import (
    Figure,
    Incoming,
    Job,
    JobFailure,
    Outgoing,
    Segmentation,
    Timing,
)
from ros_scenesense.stages.scene_objects import fault_of, objects_of
from ros_scenesense.stages.sessions import session_of
from ros_scenesense.stages.state_file import state_path

__all__ = ["GroundingConfiguration", "GroundingStage"]

_REMEMBERED = 2000
# So many scenes may be shown again to a node that was restarted, by default two.
_KEPT_SEGMENTATIONS = 8


class GroundingStage:
    """Turns each scene and its images into groundings, objects and the segmentation used.

    A scene is refused (a problem, nothing published) if its objects cannot be told apart or are
    too many, or if its frame has no instance ids. Where depth or the engine fails, objects and
    groundings are published with nothing located, so that the scene gets its decision downstream.

    With `scene_source: self` nobody announces scenes: the stage chooses frames itself, one scene at
    a time, and publishes `scene` too.

    Attributes:
        cloud_wanted: Whether somebody takes the cloud. Nodes set it.

    Raises:
        StateError: If a state file cannot be used.
    """

    def __init__(self, configuration: GroundingConfiguration) -> None:
        self.configuration = configuration
        self.health = Health()
        self.cloud_wanted = False
        self._store = GroundingStore(
            state_path(configuration.state_dir, "grounding.db"),
            self.health,
            configuration.remembered_scenes,
            MetricSettings(human_weight=configuration.feedback_weight),
        )
        self._own = _own_scenes(configuration, self.health)
        self._own_under_way: str | None = None
        self._join = SceneJoin(
            ("frame", "scene"), configuration.join_timeout_s, LATE_COMERS, bulky=("frame",)
        )
        self._taken: OrderedDict[str, None] = OrderedDict()
        self._incomplete: OrderedDict[int, None] = OrderedDict()
        self._segmentations: OrderedDict[int, Segmentation] = OrderedDict()
        self._in_vain: set[str] = set()
        self._jobs: list[Job] = []

    def engine(self) -> Callable[[], Any] | None:
        """A factory of the grounding engine."""
        return partial(GroundingEngine, self.configuration)

    def start(self, now_ns: int) -> list[Outgoing]:
        """Nothing is published before a scene came."""
        del now_ns
        return []

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes `msr_update`, and `scene` and frames, which belong together by their stamp."""
        if isinstance(item, MsrUpdate):
            return self._learn(item)
        if self._own is not None:
            return self._handle_freely(self._own, item, now_ns)
        if isinstance(item, Frame):
            return self._take(item.stamp_ns, "frame", item, now_ns)
        if isinstance(item, Scene):
            return self._take(item.stamp.nanoseconds, "scene", item, now_ns)
        return []

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Gives up what waited too long for its other half; announces a scene that is due."""
        for stamp_ns, missing in self._join.expired(now_ns):
            self._give_up(stamp_ns, missing[0])
        if self._own is not None:
            self._own.expire(now_ns)
        return self._announce(now_ns)

    def capture(self, now_ns: int) -> tuple[str | None, str]:
        """Wants the next frame that comes to be a scene.

        Returns:
            Its scene id, or None; and the same in words for the caller.
        """
        if self._own is None:
            return (
                None,
                "scenes come from the topic 'scene': set the parameter scene_source to self",
            )
        scene_id = self._own.ask(now_ns)
        if scene_id is None:
            return None, "too many scenes wait for their frames already"
        return scene_id, f"the next frame becomes scene {scene_id}"

    def camera_moved(self) -> tuple[bool, str]:
        """Somebody knows that the camera moved: people's words may be meant along other axes.

        Returns:
            Whether that is remembered; and the same in words for the caller.
        """
        if not self._store.expect_change():
            return False, "grounding.db cannot be written: see the node's log"
        return True, "what people say next tells along which axes they name relations"

    def jobs(self) -> list[Job]:
        """Grounding of the scenes that are complete."""
        jobs, self._jobs = self._jobs, []
        return jobs

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """Takes a grounded scene or a cloud; announces the next scene that is due."""
        failed = isinstance(result, JobFailure)
        if job.method == "cloud":
            if failed:
                self.health.problem("cloud_failed", f"no cloud of {job.key}: {result.reason}")
            return [] if failed else [result]
        frame, scene, learned = job.arguments
        if failed and result.dropped:
            return self._drop(frame, scene, result.reason) + self._announce(now_ns)
        if failed:
            words = f"scene {job.key} was not grounded, nothing is located: {result.reason}"
            self.health.problem("grounding_failed", words)
            result = unlocated(frame, scene, self.configuration, learned)
        published = self._publish(frame, result)
        if job.key == self._own_under_way:
            self._own_under_way = None
        return published + self._announce(now_ns)

    def close(self) -> None:
        """Closes the state files."""
        self._store.close()
        if self._own is not None:
            self._own.close()

    def _learn(self, update: MsrUpdate) -> list[Outgoing]:
        """Merges evidence; what was before or comes too early changes nothing."""
        start = time.perf_counter()
        if update.id <= self._store.applied:
            self.health.count("repeated")
            return []
        if not self._store.apply(update):
            self.health.count("updates_not_applied")
            return []
        self.health.count("updates_applied")
        elapsed_ms = (time.perf_counter() - start) * 1e3
        return [
            Timing("grounding/learn", elapsed_ms),
            Figure("grounding/viewpoint_yaw", self._store.memory.yaw_rad),
        ]

    def _handle_freely(self, own: OwnScenes, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes the frames of a camera that announces no scenes."""
        if isinstance(item, Scene) and session_of(item.scene_id) != own.session:
            self.health.problem(
                "scene_ignored",
                f"scene {item.scene_id} of somebody else is ignored: grounding announces the "
                "scenes itself (parameter scene_source)",
            )
        if not isinstance(item, Frame) or self._lacks_instances(item):
            return []
        own.offer(item, now_ns)
        return self._announce(now_ns)

    def _announce(self, now_ns: int) -> list[Outgoing]:
        """The next scene of its own, once the one before is finished."""
        if self._own is None or self._own_under_way is not None:
            return []
        taken = self._own.take(now_ns)
        if taken is None:
            return []
        frame, scene = taken
        self._admit(frame, scene)
        if not self._jobs:  # it was refused: nobody shall wait for the rest of it
            return []
        self._own_under_way = scene.scene_id
        return [scene]

    def _publish(self, frame: Frame, result: GroundingResult) -> list[Outgoing]:
        for kind, words in result.problems:
            self.health.problem(kind, words)
        if result.record is not None:
            self._store.record_scene(result.record)
        self.health.count("scenes_grounded")
        unlocated_count = sum(one.box is None for one in result.objects.objects)
        self.health.count("objects_not_located", unlocated_count)
        segmentation = Segmentation(frame.stamp_ns, frame.frame_id, result.instances)
        _remember(self._segmentations, frame.stamp_ns, segmentation, _KEPT_SEGMENTATIONS)
        return [result.objects, result.groundings, segmentation, *result.timings]

    def _drop(self, frame: Frame, scene: Scene, reason: str) -> list[Outgoing]:
        """Scenes come faster than they can be grounded: this one may come again later."""
        self.health.problem("scenes_dropped", f"scene {scene.scene_id} is not grounded: {reason}")
        self._join.forget(frame.stamp_ns)
        self._taken.pop(scene.scene_id, None)
        return []

    def _take(self, stamp_ns: int, part: str, item: Frame | Scene, now_ns: int) -> list[Outgoing]:
        if self._join.knows(stamp_ns, part):
            self.health.count("repeated")
            # All else that was published of it is kept by its topic for who missed it.
            segmentation = self._segmentations.get(stamp_ns) if part == "frame" else None
            return [] if segmentation is None else [segmentation]
        if isinstance(item, Frame) and self._lacks_instances(item):
            return []
        joined = self._join.add(stamp_ns, part, item, now_ns)
        if joined is not None:
            self._in_vain.clear()
            self._admit(joined["frame"], joined["scene"])
        return []

    def _lacks_instances(self, frame: Frame) -> bool:
        """Reports a frame without the instance ids it needs; it may come again with them."""
        if self.configuration.segments:
            return False
        try:
            instances_of(frame)
        except FrameError as error:
            if frame.stamp_ns not in self._incomplete:
                _remember(self._incomplete, frame.stamp_ns)
                words = f"frame at {_seconds(frame.stamp_ns)}: {error}"
                self.health.problem("instances_missing", words)
            return True
        return False

    def _admit(self, frame: Frame, scene: Scene) -> None:
        """Makes the jobs of a complete scene, unless it was shown before or cannot be grounded."""
        if scene.scene_id in self._taken:
            self.health.count("repeated")
            return
        _remember(self._taken, scene.scene_id)
        fault = fault_of(scene) or self._fault_of_objects(frame, scene)
        if fault is not None:
            self.health.problem("scene_refused", f"scene {scene.scene_id}: {fault}")
            return
        deadline_s = self.configuration.job_deadline_s
        learned = Learned(self._store.memory, self._store.applied)
        grounding = (frame, scene, learned)
        self._jobs.append(Job(scene.scene_id, "ground", grounding, deadline_s, droppable=True))
        if self.cloud_wanted:
            self._jobs.append(Job(scene.scene_id, "cloud", (frame,), deadline_s, droppable=True))

    def _fault_of_objects(self, frame: Frame, scene: Scene) -> str | None:
        """Why the instance ids do not fit to the scene; None if they do."""
        if self.configuration.segments:
            if not scene.objects:
                return None
            return (
                f"it names {len(scene.objects)} objects by instance ids, but grounding tells "
                "objects apart itself (parameter instances)"
            )
        count = len(objects_of(instances_of(frame), scene))
        limit = self.configuration.max_objects
        if count <= limit:
            return None
        return f"{count} objects in scene and instance image, the parameter max_objects is {limit}"

    def _give_up(self, stamp_ns: Any, missing: str) -> None:
        kind = f"{missing}_missing"
        # A camera without scenes, or the latched scenes after a restart, warn once, not each time.
        if missing in self._in_vain or (missing == "frame" and stamp_ns in self._incomplete):
            self.health.count(kind)
            return
        self._in_vain.add(missing)
        waited = f"{_seconds(stamp_ns)} waited {self.configuration.join_timeout_s:g} s in vain for"
        words = {
            "frame": f"the scene at {waited} its images: publish colour, depth, camera info and "
            "instance ids with exactly the stamp of the scene",
            "scene": f"the images at {waited} their scene: publish a scene message with exactly "
            "the stamp of the images, or set the parameter scene_source to self",
        }
        self.health.problem(kind, f"{words[missing]} (more such are only counted)")


def _own_scenes(configuration: GroundingConfiguration, health: Health) -> OwnScenes | None:
    if configuration.scene_source != SELF:
        return None
    return OwnScenes(
        SceneNumbers(configuration.state_dir, configuration.session, health),
        configuration.capture_rate_hz,
        configuration.join_timeout_s,
        health,
    )


def _seconds(stamp_ns: int) -> str:
    return "{}.{:09d}".format(*divmod(stamp_ns, 1_000_000_000))


def _remember(
    memory: OrderedDict[Any, Any], key: Hashable, value: Any = None, capacity: int = _REMEMBERED
) -> None:
    """Adds to a bounded memory; the oldest is forgotten."""
    memory[key] = value
    while len(memory) > capacity:
        memory.popitem(last=False)
