"""A camera for benchmarks: shows scenes that were made before, paced or at a fixed rate."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from rclpy.clock import Clock, ClockType
from std_msgs.msg import String

from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.scenes import KnownObject, Labels, Scene
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.frames import FramePublisher
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.scene import Frame

MOST_IN_FLIGHT = 2
"""At a rate: image topics keep few messages, so a machine that stalls must not let them pile up."""


@dataclass(frozen=True, eq=False)
class Take:
    """What is shown: a frame with instance ids, and its objects."""

    frame: Frame
    objects: list[KnownObject]


class Player:
    """Shows takes in turn, again from the first after the last.

    Args:
        node: Publishes and listens.
        session: First part of the scene ids; nobody else may use it.
    """

    def __init__(self, node: Any, session: str) -> None:
        self._node = node
        self._session = session
        self._takes: Sequence[Take] = ()
        self._next = 0
        self._left = 0
        self._open: set[str] = set()
        self._timer: Any = None
        self._frames = FramePublisher(node)
        self._publishers = {
            message: node.create_publisher(
                String, TOPICS[message].name, profile_of(TOPICS[message].qos)
            )
            for message in (Scene, Labels)
        }
        topic = TOPICS[Estimates]
        node.create_subscription(String, topic.name, self._settle, profile_of(topic.qos))

    def has_audience(self) -> bool:
        """Whether grounding and attention take the images; instance ids are for grounding alone."""
        return all(
            publisher.get_subscription_count() >= (1 if part == "instances" else 2)
            for part, publisher in self._frames.publishers.items()
        )

    def play(self, takes: Sequence[Take], scenes: int, in_flight: int) -> None:
        """Shows so many scenes; a new one whenever fewer than `in_flight` wait for estimates."""
        self._begin(takes, scenes)
        for _ in range(in_flight):
            self._show()

    def play_at(self, takes: Sequence[Take], scenes: int, rate_hz: float) -> None:
        """Shows so many scenes at a rate; those that would make too many in flight come later."""
        self._begin(takes, scenes)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = self._node.create_timer(1.0 / rate_hz, self._show_in_time, clock=steady)

    def _begin(self, takes: Sequence[Take], scenes: int) -> None:
        self._takes, self._left = takes, scenes
        self._open.clear()
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None

    def _settle(self, message: String) -> None:
        scene_id = decode(message.data, Estimates).scene_id
        if scene_id not in self._open:
            return
        self._open.remove(scene_id)
        if self._timer is None:
            self._show()

    def _show_in_time(self) -> None:
        if len(self._open) < MOST_IN_FLIGHT:
            self._show()

    def _show(self) -> None:
        if self._left == 0:
            return
        take = self._takes[self._next % len(self._takes)]
        scene_id = f"{self._session}-{self._next:04d}"
        self._next += 1
        self._left -= 1
        self._open.add(scene_id)
        stamp_ns = time.time_ns()
        stamp = Stamp.of(stamp_ns)
        scene = Scene(
            stamp=stamp,
            scene_id=scene_id,
            mode="testing",
            objects=take.objects,
            camera_pose=take.frame.camera_pose,
        )
        labels = Labels(stamp=stamp, scene_id=scene_id, use="evaluate", objects=[], structures=[])
        self._publish(scene)
        self._publish(labels)
        self._frames.publish(replace(take.frame, stamp_ns=stamp_ns))

    def _publish(self, message: Scene | Labels) -> None:
        self._publishers[type(message)].publish(String(data=encode(message).decode()))
