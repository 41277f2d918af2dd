"""What was seen of a run, joined per scene. No ROS: the observer feeds it, tests too.

The first message of each kind wins, as everywhere in the graph; a scene that is shown again after
a time-out only adds the stamp of its new images.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from ros_scenesense.messages.attention import Estimate, Estimates, Rois
from ros_scenesense.messages.base import AnyMessage, SceneMessage
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.learning import Axioms
from ros_scenesense.messages.reasoning import Belief, Beliefs, Knowledge, Verdict, Verdicts
from ros_scenesense.messages.scenes import Labels, Scene, SceneLost
from ros_scenesense.scene import DecisionStatus, Task, Truth
from ros_scenesense.stages.protocol import Timing

MAX_FRAMES = 100
"""Images are kept of this many frames: what a report can show, and a bound on the memory."""

_PARTS: dict[type[SceneMessage], str] = {
    Scene: "scene",
    Labels: "labels",
    Objects: "objects",
    Relations: "relations",
    Beliefs: "beliefs",
    Rois: "rois",
    Estimates: "estimates",
    Verdicts: "verdicts",
    SceneLost: "lost",
}
_NOBODY = Estimate(value=None, source="none")


class Subject(StrEnum):
    """What is counted: both tasks per object, stability per structure and per real stack."""

    STABILITY = "stability"
    OCCLUSION = "occlusion"
    STRUCTURE_STABILITY = "structure_stability"
    STACK_STABILITY = "stack_stability"


@dataclass(frozen=True)
class Decision:
    """What reasoning believes, what was decided in the end, and what physics says of both.

    Attributes:
        subject: The task, and whether it is about an object, a structure or a stack.
        names: The object, or the sorted members of the structure.
        belief: What reasoning decided.
        label: The truth; None where nobody labelled.
        right: Whether a decided belief agrees with a label that is clear; else None.
        estimate: What was decided in the end, and by whom.
        final_right: Whether that agrees with a label that is clear; None if nobody decided.
    """

    subject: Subject
    names: tuple[str, ...]
    belief: Belief
    label: Truth | None
    right: bool | None
    estimate: Estimate = _NOBODY
    final_right: bool | None = None

    @property
    def decided(self) -> bool:
        """Whether reasoning decided, strictly or by default."""
        return self.belief.status in (DecisionStatus.STRICT, DecisionStatus.BY_DEFAULT)


@dataclass
class SceneRecord:
    """One scene: the first message of each kind, None where it did not come.

    Attributes:
        scene_id: `<session>-<number>`.
        number: Place in the session, from 0.
        settled_ns: When the estimates came, nanoseconds; None before.
        cycle: Learning cycles that there had been when reasoning decided about it.
        stamps_ns: The stamps under which it was shown.
    """

    scene_id: str
    number: int
    settled_ns: int | None = None
    cycle: int = 0
    stamps_ns: list[int] = field(default_factory=list)
    scene: Scene | None = None
    labels: Labels | None = None
    objects: Objects | None = None
    relations: Relations | None = None
    beliefs: Beliefs | None = None
    rois: Rois | None = None
    estimates: Estimates | None = None
    verdicts: Verdicts | None = None
    lost: SceneLost | None = None

    @property
    def is_settled(self) -> bool:
        """Whether the graph is done with it."""
        return self.estimates is not None or self.lost is not None

    @property
    def is_lost(self) -> bool:
        """Whether the camera gave it up and no estimate came."""
        return self.estimates is None and self.lost is not None

    @property
    def is_complete(self) -> bool:
        """Whether no message is missing."""
        seen = (self.scene, self.labels, self.objects, self.relations)
        concluded = (self.beliefs, self.verdicts, self.rois, self.estimates)
        return all(part is not None for part in (*seen, *concluded))

    @property
    def latency_ms(self) -> float | None:
        """From the stamp of the frame to the estimates; None before they came."""
        if self.estimates is None or self.settled_ns is None:
            return None
        return (self.settled_ns - self.estimates.stamp.nanoseconds) / 1e6

    def decisions(self) -> Iterator[Decision]:
        """Everything there is to decide; a real stack is given twice, also as a stack."""
        if self.beliefs is None:
            return
        estimates = self._estimates()
        for about in self.beliefs.objects:
            for subject, task, belief in (
                (Subject.STABILITY, Task.STABILITY, about.stable),
                (Subject.OCCLUSION, Task.OCCLUSION, about.occluded),
            ):
                verdict = self._verdict("object", task, [about.name])
                estimate = estimates.get((task, (about.name,)), _NOBODY)
                yield _decision(subject, (about.name,), belief, verdict, estimate)
        for structure in self.beliefs.structures:
            members = tuple(structure.members)
            verdict = self._verdict("structure", Task.STABILITY, structure.members)
            estimate = estimates.get((Task.STABILITY, members), _NOBODY)
            about_all = (members, structure.stable, verdict, estimate)
            yield _decision(Subject.STRUCTURE_STABILITY, *about_all)
            if len(members) > 1:
                yield _decision(Subject.STACK_STABILITY, *about_all)

    def _estimates(self) -> dict[tuple[Task, tuple[str, ...]], Estimate]:
        if self.estimates is None:
            return {}
        found: dict[tuple[Task, tuple[str, ...]], Estimate] = {}
        # A structure of one is as stable as its object.
        for structure in self.estimates.structures:
            found[Task.STABILITY, tuple(structure.members)] = structure.stable
        for each in self.estimates.objects:
            found[Task.STABILITY, (each.name,)] = each.stable
            found[Task.OCCLUSION, (each.name,)] = each.occluded
        return found

    def _verdict(self, kind: str, task: Task, names: list[str]) -> Verdict | None:
        if self.verdicts is None:
            return None
        for verdict in self.verdicts.verdicts:
            if (verdict.kind, verdict.task, verdict.subject) == (kind, task, names):
                return verdict
        return None


@dataclass(frozen=True, eq=False)
class Image:
    """An image of a scene: colour (H, W, 3) uint8 RGB, or instance ids (H, W) uint16."""

    stamp_ns: int
    pixels: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]

    @property
    def is_color(self) -> bool:
        """Whether it shows colours, not instance ids."""
        return self.pixels.ndim == 3


@dataclass
class NodeRecord:
    """A node by its heartbeats.

    Attributes:
        latest: The newest heartbeat.
        received_ns: When it came.
        processes: How many processes the node has had: more than one after a restart.
    """

    latest: Heartbeat
    received_ns: int
    processes: int = 1


class RunRecord:
    """Everything that was seen of a run.

    Args:
        session: First part of the scene ids; scenes of other sessions are counted and ignored.
            None = all are taken.

    Attributes:
        scenes: By scene id, in the order in which they were first heard of.
        nodes: By node name.
        timings: Milliseconds by timing name, in the order in which they came.
        knowledge: The axioms in force.
        cycles: The learned axioms after each learning cycle.
        foreign: Number of messages about scenes of other sessions.
    """

    def __init__(self, session: str | None) -> None:
        self.session = session
        self.scenes: dict[str, SceneRecord] = {}
        self.nodes: dict[str, NodeRecord] = {}
        self.timings: dict[str, list[float]] = {}
        self.knowledge: Knowledge | None = None
        self.cycles: list[Axioms] = []
        self.foreign = 0
        self._images: dict[tuple[int, bool], Image] = {}

    def take(self, item: AnyMessage | Image | Timing, now_ns: int) -> None:
        """Adds what was received; anything that says nothing about a run is ignored."""
        match item:
            case Image():
                self._take_image(item)
            case Timing():
                self.timings.setdefault(item.name, []).append(item.milliseconds)
            case Knowledge():
                self.knowledge = item
            case Axioms():
                if item.cycle > self._cycle:
                    self.cycles.append(item)
            case Heartbeat():
                self._take_heartbeat(item, now_ns)
            case SceneMessage() if type(item) in _PARTS:
                self._take_part(item, _PARTS[type(item)], now_ns)

    @property
    def _cycle(self) -> int:
        return self.cycles[-1].cycle if self.cycles else 0

    def in_order(self) -> list[SceneRecord]:
        """The scenes by number."""
        return sorted(self.scenes.values(), key=lambda scene: scene.number)

    def settled(self) -> list[SceneRecord]:
        """The scenes that the graph is done with, by number."""
        return [scene for scene in self.in_order() if scene.is_settled]

    def has_all(self, scenes: int) -> bool:
        """Whether this many scenes are settled and nothing about them is missing."""
        settled = self.settled()
        return len(settled) >= scenes and all(
            scene.is_lost or (scene.is_complete and self._has_images(scene)) for scene in settled
        )

    def all_beat_since(self, time_ns: int) -> bool:
        """Whether every known node has sent a heartbeat after this time."""
        return all(node.received_ns > time_ns for node in self.nodes.values())

    def decisions(self) -> Iterator[Decision]:
        """All decisions about the scenes that were not lost."""
        for scene in self.settled():
            if not scene.is_lost:
                yield from scene.decisions()

    def image(self, scene: SceneRecord, color: bool) -> Image | None:
        """The first image of a scene that was received, or None."""
        for stamp_ns in scene.stamps_ns:
            if (stamp_ns, color) in self._images:
                return self._images[stamp_ns, color]
        return None

    def _has_images(self, scene: SceneRecord) -> bool:
        full = len(self._images) >= 2 * MAX_FRAMES
        return full or all(self.image(scene, color) is not None for color in (True, False))

    def _take_image(self, image: Image) -> None:
        key = (image.stamp_ns, image.is_color)
        if len(self._images) < 2 * MAX_FRAMES:
            self._images.setdefault(key, image)

    def _take_heartbeat(self, beat: Heartbeat, now_ns: int) -> None:
        known = self.nodes.get(beat.node)
        processes = 1
        if known is not None:
            processes = known.processes + (beat.process_id != known.latest.process_id)
        self.nodes[beat.node] = NodeRecord(beat, now_ns, processes)

    def _take_part(self, item: SceneMessage, part: str, now_ns: int) -> None:
        session, _, number = item.scene_id.rpartition("-")
        if self.session not in (None, session) or not number.isdecimal():
            self.foreign += 1
            return
        record = self.scenes.setdefault(item.scene_id, SceneRecord(item.scene_id, int(number)))
        if isinstance(item, Scene) and item.stamp.nanoseconds not in record.stamps_ns:
            record.stamps_ns.append(item.stamp.nanoseconds)
        if getattr(record, part) is not None:
            return
        setattr(record, part, item)
        if isinstance(item, Estimates):
            record.settled_ns = now_ns
        if isinstance(item, Beliefs):
            record.cycle = self._cycle


def _decision(
    subject: Subject,
    names: tuple[str, ...],
    belief: Belief,
    verdict: Verdict | None,
    estimate: Estimate,
) -> Decision:
    right, final_right = None, None
    if verdict is not None and verdict.verdict in ("right", "wrong"):
        right = verdict.verdict == "right"
    label = verdict.label if verdict else None
    if estimate.value is not None and label in (Truth.TRUE, Truth.FALSE):
        final_right = estimate.value == (label is Truth.TRUE)
    return Decision(subject, names, belief, label, right, estimate, final_right)
