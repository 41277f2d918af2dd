"""Takes the messages of all topics of the graph, serialised, whoever publishes them and when."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from ros_scenesense.bags.definitions import BagTopic, bag_topic, message_class, profile_to_hear
from ros_scenesense.errors import BagError
from ros_scenesense.messages.topics import TOPICS, QosClass
from ros_scenesense.nodes.frames import TOPIC_OF_PART
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.stages.health import Health

_BIG = ("sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2")
_BIG_DEPTH, _DEPTH = 10, 200


@dataclass(frozen=True)
class TopicChoice:
    """Which topics are wanted, by patterns such as `timing/*`, relative to a namespace.

    Attributes:
        namespace: Of the graph.
        wanted: Patterns; none = every topic.
        left_out: Patterns of what is not wanted for all that.
    """

    namespace: str
    wanted: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    def takes(self, topic: str) -> bool:
        """Whether a topic of this full name is wanted."""
        if self._matches(topic, self.left_out):
            return False
        return not self.wanted or self._matches(topic, self.wanted)

    def _matches(self, topic: str, patterns: tuple[str, ...]) -> bool:
        return any(fnmatchcase(topic, self._full(pattern)) for pattern in patterns)

    def _full(self, pattern: str) -> str:
        return pattern if pattern.startswith("/") else f"{self.namespace.rstrip('/')}/{pattern}"


def patterns_of(words: str) -> tuple[str, ...]:
    """The patterns of a comma-separated list."""
    return tuple(word.strip() for word in words.split(",") if word.strip())


@dataclass
class _Heard:
    """A topic that is subscribed to."""

    type: str
    profile: QoSProfile
    subscription: Subscription
    publishers: int = 0
    announced: bool = False


class TopicWatch:
    """Subscribes to what is there and to what comes, and to our own topics before they are there.

    Args:
        node: Gets the subscriptions.
        health: Takes the problems.
        choice: Which topics are wanted.
        announce: Called with each topic before its first message.
        take: Called with the name of a topic, when a message was received (ns), and its bytes.
    """

    def __init__(
        self,
        node: Node,
        health: Health,
        choice: TopicChoice,
        announce: Callable[[BagTopic], None],
        take: Callable[[str, int, bytes], None],
    ) -> None:
        self._node = node
        self._health = health
        self._choice = choice
        self._announce = announce
        self._take = take
        self._heard: dict[str, _Heard] = {}
        self._refused: set[str] = set()
        for topic in TOPICS.values():
            self._subscribe_ahead(topic.name, String, "std_msgs/msg/String", topic.qos)
        for part, name in TOPIC_OF_PART.items():
            kind = CameraInfo if part == "camera_info" else Image
            type_name = f"sensor_msgs/msg/{kind.__name__}"
            self._subscribe_ahead(name, kind, type_name, QosClass.FRAME)

    def look(self) -> None:
        """Subscribes to what is new, and anew where other publishers ask for it."""
        for name, types in self._node.get_topic_names_and_types():
            if name in self._refused or not self._choice.takes(name):
                continue
            count = self._node.count_publishers(name)
            heard = self._heard.get(name)
            if count == 0 or (heard is not None and heard.publishers == count):
                continue
            try:
                self._follow(name, types, count)
            except BagError as error:
                self._refused.add(name)
                self._health.problem("not_recorded", f"{error}; it is not recorded")

    def _follow(self, name: str, types: Sequence[str], count: int) -> None:
        offered = [each.qos_profile for each in self._node.get_publishers_info_by_topic(name)]
        if not offered:
            return
        if len(types) > 1:
            raise BagError(f"topic {name} has several types: {', '.join(types)}")
        profile = profile_to_hear(offered, _BIG_DEPTH if types[0] in _BIG else _DEPTH)
        heard = self._heard.get(name)
        if heard is None or not _hears_alike(heard.profile, profile):
            if heard is not None:
                self._node.destroy_subscription(heard.subscription)
            heard = self._subscribe(name, message_class(types[0]), types[0], profile)
        heard.publishers = count
        if not heard.announced:
            heard.announced = True
            self._announce(bag_topic(name, heard.type, offered))

    def _subscribe_ahead(self, topic: str, kind: Any, type_name: str, qos: QosClass) -> None:
        name = self._node.resolve_topic_name(topic)
        if self._choice.takes(name):
            self._subscribe(name, kind, type_name, profile_of(qos))

    def _subscribe(self, name: str, kind: Any, type_name: str, profile: QoSProfile) -> _Heard:
        subscription = self._node.create_subscription(
            kind, name, partial(self._receive, name), profile, raw=True
        )
        self._heard[name] = _Heard(type_name, profile, subscription)
        return self._heard[name]

    def _receive(self, name: str, data: bytes, information: dict[str, Any]) -> None:
        heard = self._heard[name]
        if not heard.announced:
            # A publisher that is faster than the look at the graph: what we offer is what it does.
            heard.announced = True
            self._announce(bag_topic(name, heard.type, [heard.profile]))
        stamp_ns = int(information.get("received_timestamp", 0))
        self._take(name, stamp_ns or self._node.get_clock().now().nanoseconds, data)


def _hears_alike(one: QoSProfile, other: QoSProfile) -> bool:
    return (one.durability, one.reliability) == (other.durability, other.reliability)
