"""Hears how long the steps of all nodes take: subscribes to `timing/*` as the topics come up."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Float32

from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.stages.protocol import Timing

_TYPE = "std_msgs/msg/Float32"
_SEARCH_S = 0.2


class TimingWatch:
    """Takes the timings of a graph.

    Args:
        node: In the namespace of the graph.
        take: Called with each timing.
    """

    def __init__(self, node: Node, take: Callable[[Timing], None]) -> None:
        self._node = node
        self._take = take
        self._heard: set[str] = set()
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(_SEARCH_S, self._look, clock=steady)

    def _look(self) -> None:
        # Nobody knows in advance which steps the nodes will time.
        start = f"{self._node.get_namespace().rstrip('/')}/timing/"
        for topic, types in self._node.get_topic_names_and_types():
            if topic.startswith(start) and _TYPE in types and topic not in self._heard:
                self._heard.add(topic)
                take = partial(self._receive, topic.removeprefix(start))
                self._node.create_subscription(Float32, topic, take, profile_of(QosClass.REQUEST))

    def _receive(self, name: str, received: Float32) -> None:
        self._take(Timing(name, float(received.data)))
