"""Fixtures of the tests that use ROS: a domain of their own, and waiting for conditions.

The environment is set before anything imports rclpy.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import pytest
from hypothesis import settings

from ros_scenesense.resources import resource

# One domain per test process, so that runs side by side do not hear each other.
os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 101)
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(resource("config", "fastdds_profile.xml"))
os.environ.setdefault("OMP_NUM_THREADS", "1")

# A property is judged by its answer, not by its time: the machine may be busy.
settings.register_profile("scenesense", deadline=None)
settings.load_profile("scenesense")

NAMESPACE = "/scenesense"
NodeT = TypeVar("NodeT")


def holds(condition: Callable[[], object], timeout_s: float = 60.0) -> bool:
    """Waits for what happens in other processes, which nothing but asking tells of.

    Returns:
        Whether the condition held in time.
    """
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


class RosRoom:
    """A ROS context of its own with nodes under one single-threaded executor."""

    def __init__(self) -> None:
        from rclpy.context import Context
        from rclpy.executors import SingleThreadedExecutor

        self.context = Context()
        self.context.init(args=[])
        self.executor = SingleThreadedExecutor(context=self.context)
        self._nodes: list[Any] = []

    def add(self, make: Callable[..., NodeT], *arguments: Any, **parameters: Any) -> NodeT:
        """Makes a node with these parameters and spins it from now on."""
        from rclpy.parameter import Parameter

        node = make(
            *arguments,
            context=self.context,
            namespace=NAMESPACE,
            use_global_arguments=False,
            parameter_overrides=[
                Parameter(name, value=value) for name, value in parameters.items()
            ],
        )
        self._nodes.append(node)
        self.executor.add_node(node)
        return node

    def remove(self, node: Any) -> None:
        """Ends a node before the room is closed."""
        self._nodes.remove(node)
        self.executor.remove_node(node)
        node.destroy_node()

    def probe(self) -> Probe:
        """A node that listens and talks for the test."""
        from rclpy.node import Node

        return Probe(self.add(Node, "probe"))

    def wait_for(self, condition: Callable[[], Any], timeout_s: float = 20.0) -> bool:
        """Spins until a condition holds; returns whether it did in time."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > deadline:
                return False
            self.executor.spin_once(timeout_sec=0.05)
        return True

    def close(self) -> None:
        for node in reversed(self._nodes):
            node.destroy_node()
        self.executor.shutdown()
        self.context.try_shutdown()


class Probe:
    """Publishes and collects what the test wants, JSON messages by their type."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self._publishers: dict[str, Any] = {}

    def collect(self, message: type[Any]) -> list[Any]:
        """A list that grows by each decoded message of the type; what is none is passed over."""
        from std_msgs.msg import String

        from ros_scenesense.errors import MessageError
        from ros_scenesense.messages.codec import decode
        from ros_scenesense.messages.topics import TOPICS
        from ros_scenesense.nodes.qos import profile_of

        topic = TOPICS[message]
        received: list[Any] = []

        def take(text: String) -> None:
            with contextlib.suppress(MessageError):
                received.append(decode(text.data, message))

        self.node.create_subscription(String, topic.name, take, profile_of(topic.qos))
        return received

    def collect_raw(self, kind: type[Any], topic: str, qos: Any = 10) -> list[Any]:
        """A list that grows by each message of a ROS type."""
        received: list[Any] = []
        self.node.create_subscription(kind, topic, received.append, qos)
        return received

    def say(self, message: Any) -> None:
        """Publishes a message on its topic."""
        from ros_scenesense.messages.codec import encode

        self.say_text(type(message), encode(message).decode())

    def say_text(self, message: type[Any], text: str) -> None:
        """Publishes any text on the topic of a message type."""
        from std_msgs.msg import String

        self.publisher(message).publish(String(data=text))

    def publisher(self, message: type[Any]) -> Any:
        """The publisher on the topic of a message type."""
        from std_msgs.msg import String

        from ros_scenesense.messages.topics import TOPICS
        from ros_scenesense.nodes.qos import profile_of

        topic = TOPICS[message]
        if topic.name not in self._publishers:
            self._publishers[topic.name] = self.node.create_publisher(
                String, topic.name, profile_of(topic.qos)
            )
        return self._publishers[topic.name]


@pytest.fixture
def ros_room() -> Iterator[RosRoom]:
    room = RosRoom()
    yield room
    room.close()


@pytest.fixture(scope="module")
def shared_ros_room() -> Iterator[RosRoom]:
    """One room for all tests of a module, where building nodes takes seconds."""
    room = RosRoom()
    yield room
    room.close()
