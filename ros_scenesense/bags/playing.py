"""Plays a bag: every message byte for byte on its topic, in its time, or scene by scene."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock as NodeClock
from rclpy.clock import ClockType
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from ros_scenesense.bags.definitions import message_class, profile_to_play
from ros_scenesense.bags.inputs import Recorded
from ros_scenesense.bags.reading import BagDescription, read_messages
from ros_scenesense.errors import BagError

CLOCK_TOPIC = "/clock"
_BIG = ("sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2")
_BIG_DEPTH, _DEPTH = 10, 200
_QUIET_S, _LONGEST_QUIET_S = 0.5, 5.0
_ACKNOWLEDGED_S = 5.0
_SLICE_S = 0.05


@dataclass(frozen=True)
class PlayOptions:
    """How a bag is played.

    Attributes:
        rate: How many times faster than it was recorded.
        loops: How often; 0 = until somebody stops it.
        clock_hz: `/clock` tells the time of the bag so often a second; 0 = it is not published.
    """

    rate: float = 1.0
    loops: int = 1
    clock_hz: float = 0.0


class BagClock:
    """The time of the bag while it is played.

    Args:
        rate: Seconds of the bag per second.
        monotonic: Seconds that only grow.
    """

    def __init__(self, rate: float, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._monotonic = monotonic
        self._begin_s, self._begin_ns = monotonic(), 0

    def begin(self, stamp_ns: int) -> None:
        """It is this time now."""
        self._begin_s, self._begin_ns = self._monotonic(), stamp_ns

    @property
    def now_ns(self) -> int:
        """The time of the bag."""
        return self._begin_ns + round((self._monotonic() - self._begin_s) * self._rate * 1e9)

    def seconds_until(self, stamp_ns: int) -> float:
        """How long it takes until it is this time; negative if it was before."""
        return (stamp_ns - self.now_ns) / 1e9 / self._rate


class Player:
    """Publishes the messages of a bag.

    Args:
        node: Gets the publishers.
        executor: Runs the node while time passes.
        bag: What is played.
        topics: Names of the topics that are played.
        options: How.
        stopped: Whether somebody wants it to stop.
        monotonic: Seconds that only grow.

    Attributes:
        published: How many messages were published so far.
        skipped: Topics that cannot be played, each with why.
    """

    def __init__(
        self,
        node: Node,
        executor: SingleThreadedExecutor,
        bag: BagDescription,
        topics: Iterable[str],
        options: PlayOptions,
        stopped: Callable[[], bool] = lambda: False,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self.published = 0
        self.skipped: dict[str, str] = {}
        self._node, self._executor = node, executor
        self._bag, self._options, self._stopped = bag, options, stopped
        self._clock = BagClock(options.rate, monotonic)
        # Before the first message its time stands still at the beginning of the bag.
        self._shown_ns: int | None = bag.start_ns
        self._publishers = self._open(set(topics))
        self._clock_publisher: Publisher | None = None
        if options.clock_hz:
            self._clock_publisher = node.create_publisher(Clock, CLOCK_TOPIC, QoSProfile(depth=1))
            steady = NodeClock(clock_type=ClockType.STEADY_TIME)
            node.create_timer(1.0 / options.clock_hz, self._tell_time, clock=steady)

    @property
    def stopped(self) -> bool:
        """Whether somebody wants it to stop."""
        return self._stopped()

    @property
    def messages(self) -> Iterator[Recorded]:
        """The messages of the topics that are played, in order."""
        return read_messages(self._bag.folder, self._publishers.__contains__)

    def wait_for_audience(self, topic: str, timeout_s: float) -> bool:
        """Waits until somebody takes a topic; returns whether that was so in time."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            return False
        return self.spin_until(lambda: publisher.get_subscription_count() > 0, timeout_s)

    def wait_for_quiet(self) -> None:
        """Waits until nobody joins any more, so that the first message reaches all."""
        count, since = -1, time.monotonic()
        deadline = since + _LONGEST_QUIET_S
        while time.monotonic() < deadline and not self._stopped():
            now = sum(each.get_subscription_count() for each in self._publishers.values())
            if now != count:
                count, since = now, time.monotonic()
            elif time.monotonic() - since >= _QUIET_S:
                return
            self._executor.spin_once(timeout_sec=_SLICE_S)

    def play(self) -> None:
        """Publishes all messages in their time, so often as the options say."""
        loop = 0
        while not self._stopped() and (loop < self._options.loops or not self._options.loops):
            self._play_once()
            loop += 1
        self._wait_for_acknowledgements()

    def publish(self, messages: Iterable[Recorded]) -> None:
        """Publishes messages at once; the time of the bag is that of the last one."""
        for topic, stamp_ns, data in messages:
            self._shown_ns = stamp_ns
            self._tell_time()
            self._publishers[topic].publish(data)
            self.published += 1

    def spin_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Lets time pass until a condition holds; returns whether it did in time."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > deadline or self._stopped():
                return False
            self._executor.spin_once(timeout_sec=_SLICE_S)
        return True

    def _play_once(self) -> None:
        begun = False
        for topic, stamp_ns, data in self.messages:
            if not begun:
                begun = True
                self._clock.begin(stamp_ns)
                self._shown_ns = None
                self._tell_time()
            while (left_s := self._clock.seconds_until(stamp_ns)) > 0.0 and not self._stopped():
                self._executor.spin_once(timeout_sec=min(left_s, _SLICE_S))
            if self._stopped():
                return
            self._publishers[topic].publish(data)
            self.published += 1
        if not begun:
            raise BagError(f"{self._bag.folder} has no message on the topics that are to be played")

    def _tell_time(self) -> None:
        if self._clock_publisher is not None:
            now_ns = self._clock.now_ns if self._shown_ns is None else self._shown_ns
            time_of_bag = Time(nanoseconds=max(0, now_ns)).to_msg()
            self._clock_publisher.publish(Clock(clock=time_of_bag))

    def _open(self, topics: set[str]) -> dict[str, Publisher]:
        opened: dict[str, Publisher] = {}
        for topic in self._bag.topics:
            if topic.name not in topics or (self._options.clock_hz and topic.name == CLOCK_TOPIC):
                continue
            try:
                kind: Any = message_class(topic.type)
            except BagError as error:
                self.skipped[topic.name] = str(error)
                continue
            profile = profile_to_play(topic.qos, _BIG_DEPTH if topic.type in _BIG else _DEPTH)
            opened[topic.name] = self._node.create_publisher(kind, topic.name, profile)
        return opened

    def _wait_for_acknowledgements(self) -> None:
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=_ACKNOWLEDGED_S))
