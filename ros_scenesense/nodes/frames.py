"""How a frame travels: images of one stamp, published together and joined again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from rclpy.event_handler import (
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
)
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import CameraInfo, Image

from ros_scenesense.errors import FrameError
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.conversions import (
    camera_info_message,
    color_of,
    depth_of,
    header_of,
    image_message,
    instances_of,
    intrinsics_of,
    stamp_of,
)
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.scene import Frame
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.join import SceneJoin

TOPIC_OF_PART = {
    "color": "camera/color/image_raw",
    "depth": "camera/depth_registered/image_rect",
    "camera_info": "camera/color/camera_info",
    "instances": "camera/instances",
}
_TYPE_OF_PART = {"color": Image, "depth": Image, "camera_info": CameraInfo, "instances": Image}
_READ_PART: dict[str, Callable[[Any], Any]] = {
    "color": color_of,
    "depth": depth_of,
    "camera_info": intrinsics_of,
    "instances": instances_of,
}


class FramePublisher:
    """Publishes frames.

    Attributes:
        publishers: By part.
    """

    def __init__(self, node: Node) -> None:
        profile = profile_of(QosClass.FRAME)
        self.publishers: dict[str, Publisher] = {
            part: node.create_publisher(_TYPE_OF_PART[part], topic, profile)
            for part, topic in TOPIC_OF_PART.items()
        }

    def publish(self, frame: Frame) -> None:
        """Publishes the parts of a frame, all with its stamp."""
        header = header_of(frame.stamp_ns, frame.frame_id)
        messages = {
            "color": image_message(header, frame.color, "rgb8"),
            "depth": image_message(header, frame.depth, "32FC1"),
            "camera_info": camera_info_message(header, frame.intrinsics),
        }
        if frame.instances is not None:
            messages["instances"] = image_message(header, frame.instances, "16UC1")
        for part, message in messages.items():
            self.publishers[part].publish(message)


@dataclass(frozen=True)
class FrameJoining:
    """How the images of a frame find each other.

    Attributes:
        reliability: `reliable` or `best_effort`, as the camera driver publishes.
        timeout_s: How long the images of one stamp are waited for.
        slop_s: How far the stamps of one frame may lie apart; 0 = they are equal.
        with_instances: Whether instance ids belong to a frame.
    """

    reliability: str
    timeout_s: float
    slop_s: float = 0.0
    with_instances: bool = True


class FrameSubscription:
    """Joins the images of a stamp to a frame; what is wrong or missing becomes a problem.

    A frame has the stamp of its colour image.

    Args:
        node: Gets the subscriptions.
        health: Takes the problems.
        take: Called with each frame.
        joining: How the images find each other.
    """

    def __init__(
        self, node: Node, health: Health, take: Callable[[Frame], None], joining: FrameJoining
    ) -> None:
        self._node = node
        self._health = health
        self._take = take
        self._slop_ns = round(joining.slop_s * 1e9)
        parts = [part for part in TOPIC_OF_PART if part != "instances" or joining.with_instances]
        # No memory of finished frames: one that is shown again must reach the stage again.
        self._join = SceneJoin(tuple(parts), joining.timeout_s, memory=0)
        for part in parts:
            callback = partial(self._receive, part)
            profile = profile_of(QosClass.FRAME, joining.reliability)
            events = SubscriptionEventCallbacks(
                incompatible_qos=partial(self._refuse, part), use_default_callbacks=False
            )
            node.create_subscription(
                _TYPE_OF_PART[part], TOPIC_OF_PART[part], callback, profile, event_callbacks=events
            )

    def expire(self, now_ns: int) -> None:
        """Gives up the frames that waited too long; called regularly."""
        for stamp_ns, missing in self._join.expired(now_ns):
            topics = ", ".join(TOPIC_OF_PART[part] for part in missing)
            self._health.problem(
                "incomplete_frame",
                f"frame of stamp {stamp_ns} ns is dropped: no image with this stamp on {topics} "
                f"within {self._join.timeout_s:g} s; publish all with one header.stamp, or say "
                "with the parameter image_slop_s how far the stamps lie apart",
            )

    def _refuse(self, part: str, _event: QoSRequestedIncompatibleQoSInfo) -> None:
        self._health.problem(
            "incompatible_camera",
            f"a camera publishes {TOPIC_OF_PART[part]} with a quality of service that gives this "
            "node nothing: set the parameter image_reliability to best_effort",
        )

    def _receive(self, part: str, message: Any) -> None:
        stamp_ns = stamp_of(message.header)
        try:
            value = _READ_PART[part](message)
        except FrameError as error:
            # It still takes its place in the join: its frame is dropped with this one warning.
            self._health.problem(f"bad_{part}", f"frame of stamp {stamp_ns} ns is dropped: {error}")
            value = None
        key = stamp_ns
        if self._slop_ns:
            near = self._join.nearest(stamp_ns, part, self._slop_ns)
            key = stamp_ns if near is None else near
        received = _Received(stamp_ns, message.header.frame_id, value)
        parts = self._join.add(key, part, received, self._now_ns())
        if parts is not None and all(each.value is not None for each in parts.values()):
            self._assemble(parts)

    def _assemble(self, parts: dict[str, _Received]) -> None:
        stamp_ns, frame_id = parts["color"].stamp_ns, parts["color"].frame_id
        values = {part: received.value for part, received in parts.items()}
        intrinsics = values.pop("camera_info")
        try:
            frame = Frame(stamp_ns, frame_id, intrinsics=intrinsics, **values)
        except FrameError as error:
            self._health.problem("bad_frame", f"frame of stamp {stamp_ns} ns is dropped: {error}")
            return
        self._take(frame)

    def _now_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)


@dataclass(frozen=True, eq=False)
class _Received:
    """An image as it came; without a value if it cannot be read."""

    stamp_ns: int
    frame_id: str
    value: Any
