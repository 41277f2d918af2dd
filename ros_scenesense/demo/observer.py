"""Listens to the graph and feeds a `RunRecord`. The only file of the demo that knows ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Protocol

import rclpy
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import Image as ImageMessage
from std_msgs.msg import String

from ros_scenesense.demo.record import Image
from ros_scenesense.errors import FrameError, MessageError
from ros_scenesense.messages.attention import Estimates, Rois
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.learning import Axioms
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, Verdicts
from ros_scenesense.messages.scenes import Labels, Scene, SceneLost
from ros_scenesense.messages.topics import TOPICS, QosClass
from ros_scenesense.nodes.conversions import color_of, instances_of, stamp_of
from ros_scenesense.nodes.frames import TOPIC_OF_PART
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.timing_watch import TimingWatch
from ros_scenesense.stages.protocol import Timing

_MESSAGES: tuple[type[AnyMessage], ...] = (
    Scene,
    SceneLost,
    Labels,
    Objects,
    Relations,
    Beliefs,
    Verdicts,
    Rois,
    Estimates,
    Knowledge,
    Axioms,
    Heartbeat,
)
_REFRESH_S = 0.1


class Taker(Protocol):
    """Takes what is received."""

    def take(self, item: AnyMessage | Image | Timing, now_ns: int) -> None:
        """Takes a message, an image or a timing."""


class Observer:
    """Subscribes to all that a report needs.

    Args:
        record: Takes what is received.
        refresh: Called ten times a second, whatever happens.
        more: Message types to subscribe to besides those of every report.
        node_options: Passed on to `rclpy.create_node`: `context`, `namespace`.

    Attributes:
        node: For the caller's executor; the caller destroys it.
    """

    def __init__(
        self,
        record: Taker,
        refresh: Callable[[], None],
        more: Iterable[type[AnyMessage]] = (),
        **node_options: Any,
    ) -> None:
        self.node = rclpy.create_node("demo", **node_options)
        self._record = record
        for message in (*_MESSAGES, *more):
            topic = TOPICS[message]
            take = partial(self._take_json, message)
            self.node.create_subscription(String, topic.name, take, profile_of(topic.qos))
        frames = profile_of(QosClass.FRAME)
        for topic_name, read in (
            (TOPIC_OF_PART["color"], color_of),
            ("segmentation", instances_of),
        ):
            take_image = partial(self._take_image, read)
            self.node.create_subscription(ImageMessage, topic_name, take_image, frames)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        TimingWatch(self.node, self._take)
        self.node.create_timer(_REFRESH_S, refresh, clock=steady)

    def _take_json(self, message: type[AnyMessage], received: String) -> None:
        try:
            self._take(decode(received.data, message))
        except MessageError as error:
            self.node.get_logger().warning(f"ignored: {error}")

    def _take_image(self, read: Callable[[ImageMessage], Any], received: ImageMessage) -> None:
        try:
            self._take(Image(stamp_of(received.header), read(received)))
        except FrameError as error:
            self.node.get_logger().warning(f"ignored: {error}")

    def _take(self, item: AnyMessage | Image | Timing) -> None:
        self._record.take(item, int(self.node.get_clock().now().nanoseconds))
