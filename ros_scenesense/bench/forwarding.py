"""A graph of nodes that compute nothing: each publishes what the real one had published.

Messages stay serialised, as in `topic_tools relay`: what takes time is their delivery and rclpy's
executors. `python -m ros_scenesense.bench.forwarding NODE FILE NAMESPACE` runs one such node.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from ros_scenesense.messages.topics import TOPICS, QosClass
from ros_scenesense.nodes.frames import TOPIC_OF_PART
from ros_scenesense.nodes.lean_node import LeanNode
from ros_scenesense.nodes.qos import profile_of

_QOS_OF_JSON = {topic.name: topic.qos for topic in TOPICS.values()}
_IMAGES = tuple(TOPIC_OF_PART[part] for part in ("color", "depth", "camera_info"))
_INSTANCES = TOPIC_OF_PART["instances"]
_READY = "forwarding_ready"
_ANNOUNCE_S = 0.2


@dataclass(frozen=True)
class Link:
    """What a node of the graph takes of each scene before it gives the rest."""

    takes: tuple[str, ...]
    gives: tuple[str, ...]


SOURCE = Link((), ("scene", "labels", *_IMAGES, _INSTANCES))
"""The camera."""

LINKS = {
    "grounding": Link((*_IMAGES, _INSTANCES, "scene"), ("objects", "groundings", "segmentation")),
    "grounding_control": Link(("groundings",), ("relations", "msr_update")),
    "reasoner": Link(("scene", "labels", "objects", "relations"), ("beliefs", "verdicts")),
    "attention": Link(
        (*_IMAGES, "segmentation", "objects", "relations", "beliefs"), ("rois", "estimates")
    ),
    "axiom_learner": Link(("objects", "relations", "beliefs", "verdicts"), ()),
}
"""The nodes from a frame to its estimates, and the learner, which listens too."""

PLAIN: dict[str, Any] = {"start_parameter_services": False, "enable_rosout": False}
"""Options of nodes that do nothing but forward."""

_TAKERS = Counter(topic for link in LINKS.values() for topic in link.takes)

Recording = dict[str, list[bytes]]
"""Serialised messages by topic, one for each scene."""


class Recorder:
    """Keeps what all nodes publish of each scene.

    Args:
        node: Listens.

    Attributes:
        recording: What came so far.
    """

    def __init__(self, node: Any) -> None:
        self._node = node
        self.recording: Recording = {
            topic: [] for link in (SOURCE, *LINKS.values()) for topic in link.gives
        }
        self._subscriptions = [
            node.create_subscription(
                type_of(topic), topic, messages.append, qos_of(topic), raw=True
            )
            for topic, messages in self.recording.items()
        ]

    def has(self, scenes: int) -> bool:
        """Whether so many scenes are there completely."""
        return all(len(messages) >= scenes for messages in self.recording.values())

    def close(self) -> None:
        """Ends the subscriptions."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)


class Forwarder:
    """Answers the parts of the n-th scene with what was recorded of it.

    Args:
        node: Takes part in the graph.
        link: What it takes and gives.
        recording: What to publish.
    """

    def __init__(self, node: Any, link: Link, recording: Recording) -> None:
        self._node = node
        self._link = link
        self._came = Counter[str]()
        self._given = 0
        self._recording = recording
        self._publishers = {
            topic: node.create_publisher(type_of(topic), topic, qos_of(topic))
            for topic in link.gives
        }
        for topic in link.takes:
            take = partial(self._take, topic)
            node.create_subscription(type_of(topic), topic, take, qos_of(topic), raw=True)

    @property
    def connected(self) -> bool:
        """Whether it has found all its neighbours."""
        return all(
            publisher.get_subscription_count() >= _TAKERS[topic]
            for topic, publisher in self._publishers.items()
        ) and all(self._node.count_publishers(topic) > 0 for topic in self._link.takes)

    def give(self) -> None:
        """Publishes what is recorded of the next scene."""
        for topic, publisher in self._publishers.items():
            publisher.publish(self._recording[topic][self._given])
        self._given += 1

    def _take(self, topic: str, _message: bytes) -> None:
        self._came[topic] += 1
        if all(self._came[each] > self._given for each in self._link.takes):
            self.give()


class Gathering:
    """Waits for all forwarding nodes to be connected.

    Args:
        node: Listens.
    """

    def __init__(self, node: Any) -> None:
        self._ready: set[str] = set()
        profile = profile_of(QosClass.EVENT)
        node.create_subscription(String, _READY, self._hear, profile)

    @property
    def complete(self) -> bool:
        """Whether all are connected."""
        return self._ready == set(LINKS)

    def _hear(self, message: String) -> None:
        self._ready.add(message.data)


@contextmanager
def forwarding_nodes(file: Path, namespace: str, log: Path) -> Iterator[None]:
    """Runs a process for each link.

    Args:
        file: A pickled `Recording`.
        namespace: Of nodes and topics.
        log: Takes what they print.
    """
    processes: list[subprocess.Popen[bytes]] = []
    try:
        with log.open("wb") as output:
            for name in LINKS:
                command = [sys.executable, "-m", __name__, name, str(file), namespace]
                processes.append(subprocess.Popen(command, stdout=output, stderr=output))
        yield
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(timeout=10.0)


def type_of(topic: str) -> Any:
    """The ROS type of a topic of the graph."""
    if topic in _QOS_OF_JSON:
        return String
    return CameraInfo if topic == TOPIC_OF_PART["camera_info"] else Image


def qos_of(topic: str) -> Any:
    """The quality of service of a topic of the graph."""
    return profile_of(_QOS_OF_JSON.get(topic, QosClass.FRAME))


def main() -> int:
    """Runs the node that the arguments name, until it is stopped."""
    name, file, namespace = sys.argv[1:]
    rclpy.init(args=[])
    node = LeanNode(name, namespace=namespace, **PLAIN)
    executor = SingleThreadedExecutor()
    try:
        forwarder = Forwarder(node, LINKS[name], pickle.loads(Path(file).read_bytes()))
        ready = node.create_publisher(String, _READY, profile_of(QosClass.EVENT))

        def announce() -> None:
            if forwarder.connected:
                ready.publish(String(data=name))
                node.destroy_timer(timer)

        timer = node.create_timer(_ANNOUNCE_S, announce)
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
