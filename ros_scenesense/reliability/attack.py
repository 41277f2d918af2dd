"""Sends nonsense on every topic of a running graph, and knows which node should have counted it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice

import numpy as np
from rclpy.publisher import Publisher
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.messages.codec import encode
from ros_scenesense.messages.topics import TOPICS, QosClass
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.reliability.hostile_images import TOPICS_OF_IMAGES, bad_image, false_frames
from ros_scenesense.reliability.hostile_texts import false_texts, invalid_texts
from ros_scenesense.reliability.invented import invented
from ros_scenesense.reliability.trial import Trial

# A topic keeps some images, and of a state only the last message: each is counted before the next.
_BURST = 6
_IMAGE_BURST = 3
_TOPICS_AT_ONCE = 7
_INVENTED = 5
_COUNTING_S = 20.0


@dataclass
class Sent:
    """What was sent and what came of it.

    Attributes:
        invalid: Invalid messages by topic.
        expected: How often each node should have counted them, by `node counter`.
        counted: How often it did, at most as often as expected.
        false: Messages that are well formed and false.
    """

    invalid: Counter[str] = field(default_factory=Counter)
    expected: Counter[str] = field(default_factory=Counter)
    counted: Counter[str] = field(default_factory=Counter)
    false: int = 0


class Attack:
    """An attack on the graph of a trial.

    Args:
        trial: The graph; its companion's node publishes.
        messages: How many invalid messages.
        real: Texts of messages that the graph has published, by type.
        made_up: Texts that are hardly messages, for all topics.
        seed: Of everything random.

    Attributes:
        sent: What was sent so far.
    """

    def __init__(
        self,
        trial: Trial,
        messages: int,
        real: Mapping[type[AnyMessage], Sequence[str]],
        made_up: Sequence[str],
        seed: int,
    ) -> None:
        self.sent = Sent()
        self._trial = trial
        self._messages = messages
        self._seed = seed
        self._rng = np.random.default_rng([seed, *b"attack"])
        # Of some types nobody publishes anything in a session: their messages are invented.
        self._models = {
            kind: [*real.get(kind, ()), *(invented(kind, self._rng) for _ in range(_INVENTED))]
            for kind in TOPICS
        }
        node = trial.companion.node
        self._publishers: dict[type[AnyMessage], Publisher] = {
            kind: node.create_publisher(String, topic.name, profile_of(topic.qos))
            for kind, topic in TOPICS.items()
        }
        self._images: dict[str, Publisher] = {
            part: node.create_publisher(
                CameraInfo if part == "camera_info" else Image, topic, profile_of(QosClass.FRAME)
            )
            for part, topic in TOPICS_OF_IMAGES.items()
        }
        self._wait_for_listeners()
        burst = _BURST * len(TOPICS) + _IMAGE_BURST * len(self._images)
        count = _BURST * -(-messages // burst)
        self._texts = {
            kind: invalid_texts(kind, models, made_up[number :: len(TOPICS)], count, seed)
            for number, (kind, models) in enumerate(self._models.items())
        }

    @property
    def share_done(self) -> float:
        """Share of the invalid messages that were sent."""
        return self.sent.invalid.total() / self._messages

    @property
    def _left(self) -> int:
        return self._messages - self.sent.invalid.total()

    def send_invalid(self) -> None:
        """Sends some invalid messages on every topic, as many on each JSON topic."""
        states = [kind for kind, topic in TOPICS.items() if topic.qos is QosClass.STATE]
        for number in range(_BURST):
            if number > 0:
                self.wait_until_counted()
            for kind in states:
                self._send_invalid(kind, 1)
        for kind in TOPICS:
            if kind not in states:
                self._send_invalid(kind, _BURST)
        for part, publisher in self._images.items():
            for _ in range(min(_IMAGE_BURST, self._left)):
                publisher.publish(bad_image(part, self._rng))
                self._note(part, publisher)

    def _send_invalid(self, kind: type[AnyMessage], count: int) -> None:
        for text in islice(self._texts[kind], min(count, self._left)):
            self._publishers[kind].publish(String(data=text))
            self._note(TOPICS[kind].name, self._publishers[kind])

    def wait_until_counted(self) -> list[str]:
        """Waits until every node that listens has counted what came; what is missing, in words."""
        self._trial.graph.spin_until(lambda: self._counted() >= self.sent.expected, _COUNTING_S)
        self.sent.counted = self._counted() & self.sent.expected
        missing = self.sent.expected - self.sent.counted
        return [f"{key}: {count} of {self.sent.expected[key]}" for key, count in missing.items()]

    def send_false(self, messages: int, frames: int) -> None:
        """Sends messages that are well formed and false, and frames that show nonsense."""
        share = -(-messages // len(TOPICS))
        for number, (kind, models) in enumerate(self._models.items()):
            for text in false_texts(kind, models, share, self._seed):
                self._publishers[kind].publish(String(data=text))
                self.sent.false += 1
            if number % _TOPICS_AT_ONCE == 0:
                self._rest()
        now_ns = int(self._trial.companion.node.get_clock().now().nanoseconds)
        for scene, parts in false_frames(frames, now_ns, self._rng):
            for part, message in parts.items():
                self._images[part].publish(message)
            self._publishers[type(scene)].publish(String(data=encode(scene).decode()))
            self.sent.false += len(parts) + 1
            self._rest()

    def _wait_for_listeners(self) -> None:
        """Waits until whoever listens to a topic hears us: what is sent before is lost."""
        node = self._trial.companion.node
        publishers = [*self._publishers.values(), *self._images.values()]
        self._trial.graph.spin_until(
            lambda: all(
                each.get_subscription_count()
                >= len(node.get_subscriptions_info_by_topic(each.topic_name))
                for each in publishers
            ),
            _COUNTING_S,
        )

    def _note(self, name: str, publisher: Publisher) -> None:
        self.sent.invalid[name] += 1
        node = self._trial.companion.node
        for info in node.get_subscriptions_info_by_topic(publisher.topic_name):
            if info.node_name in self._trial.graph.nodes:
                self.sent.expected[f"{info.node_name} bad_{name}"] += 1

    def _counted(self) -> Counter[str]:
        account = self._trial.companion.account
        return Counter({key: account.total(*key.split(" ")) for key in self.sent.expected})

    def _rest(self) -> None:
        """Waits for two heartbeats of every node: each has then taken what came before."""
        beats = self._trial.companion.account.beats
        until = {name: beats[name] + 2 for name in self._trial.graph.nodes}
        self._trial.graph.spin_until(
            lambda: all(beats[name] >= least for name, least in until.items()), _COUNTING_S
        )
