"""How much of a scene's latency is transport: the same messages, forwarded by idle nodes."""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.timer import Timer

from ros_scenesense.bench.forwarding import (
    PLAIN,
    SOURCE,
    Forwarder,
    Gathering,
    Recorder,
    Recording,
    forwarding_nodes,
    qos_of,
    type_of,
)
from ros_scenesense.bench.loop_graph import LoopGraph
from ros_scenesense.bench.player import MOST_IN_FLIGHT, Player, Take
from ros_scenesense.demo.domains import choose_domain
from ros_scenesense.errors import LaunchError
from ros_scenesense.nodes.lean_node import LeanNode

NAMESPACE = "/forwarding"
_PATIENCE_S = 60.0
# A recorder that has just come may miss images of the first scenes.
_SPARE = 5


def recorded(
    loop: LoopGraph, player: Player, takes: Sequence[Take], scenes: int, rate_hz: float
) -> Recording:
    """What all nodes publish of scenes that come at a rate.

    Raises:
        LaunchError: If messages are missing.
    """
    recorder = Recorder(loop.node)
    played_latencies_ms(loop, player, takes, scenes + _SPARE, rate_hz)
    loop.wait_for(lambda: recorder.has(scenes), _PATIENCE_S, "messages about scenes are missing")
    recorder.close()
    return recorder.recording


def played_latencies_ms(
    loop: LoopGraph, player: Player, takes: Sequence[Take], scenes: int, rate_hz: float
) -> list[float]:
    """Latency of each of so many scenes that come at a rate.

    Raises:
        LaunchError: If not all are settled.
    """
    begin = len(loop.settled)
    player.play_at(takes, scenes, rate_hz)
    loop.wait_for(
        lambda: len(loop.settled) >= begin + scenes, _PATIENCE_S, f"not {scenes} scenes are settled"
    )
    return [each.latency_ms for each in loop.settled[begin:]]


def forwarded_latencies_ms(
    folder: Path, recording: Recording, scenes: int, rates_hz: Sequence[float]
) -> list[list[float]]:
    """The same of nodes that only forward, for each of some rates, after as many scenes before.

    Args:
        folder: For files.
        recording: Of at least so many scenes.
        scenes: How many.
        rates_hz: How many per second.

    Raises:
        LaunchError: If the nodes do not find each other, or not all scenes arrive.
    """
    repeats = 1 + len(rates_hz)
    repeated = {topic: repeats * messages[:scenes] for topic, messages in recording.items()}
    file = folder / "recording.pickle"
    file.write_bytes(pickle.dumps(repeated))
    domain = choose_domain(None)
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    context = Context()
    context.init(args=[], domain_id=domain)
    executor = SingleThreadedExecutor(context=context)
    node = LeanNode(
        "source", namespace=NAMESPACE, context=context, use_global_arguments=False, **PLAIN
    )
    executor.add_node(node)
    try:
        source = _Source(node, repeated)
        gathering = Gathering(node)
        with forwarding_nodes(file, NAMESPACE, folder / "forwarding.log"):
            _spin_until(
                executor,
                lambda: gathering.complete and source.connected,
                "the forwarding nodes do not find each other",
            )
            for number, rate_hz in enumerate([rates_hz[0], *rates_hz], 1):
                source.start(scenes, rate_hz)
                end = number * scenes
                _spin_until(executor, partial(source.has, end), "not all is forwarded")
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()
    values = source.latencies_ms
    return [values[number * scenes : (number + 1) * scenes] for number in range(1, repeats)]


class _Source:
    """The camera of the forwarding graph, and where its estimates end.

    Attributes:
        latencies_ms: Of each scene whose estimates came.
    """

    def __init__(self, node: LeanNode, recording: Recording) -> None:
        self.latencies_ms: list[float] = []
        self._node = node
        self._forwarder = Forwarder(node, SOURCE, recording)
        self._starts: list[float] = []
        self._left = 0
        self._timer: Timer | None = None
        topic = "estimates"
        node.create_subscription(type_of(topic), topic, self._take, qos_of(topic))

    @property
    def connected(self) -> bool:
        """Whether all nodes are there that take what it gives."""
        return self._forwarder.connected and self._node.count_publishers("estimates") > 0

    def start(self, scenes: int, rate_hz: float) -> None:
        """Gives so many scenes at a rate, once those before have arrived."""
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
        self._left = scenes
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = self._node.create_timer(1.0 / rate_hz, self._give, clock=steady)

    def has(self, scenes: int) -> bool:
        """Whether the estimates of so many scenes came."""
        return len(self.latencies_ms) >= scenes

    def _give(self) -> None:
        if self._left > 0 and len(self._starts) - len(self.latencies_ms) < MOST_IN_FLIGHT:
            self._left -= 1
            self._starts.append(time.perf_counter())
            self._forwarder.give()

    def _take(self, _message: object) -> None:
        start = self._starts[len(self.latencies_ms)]
        self.latencies_ms.append((time.perf_counter() - start) * 1e3)


def _spin_until(
    executor: SingleThreadedExecutor, condition: Callable[[], bool], wrong: str
) -> None:
    deadline = time.monotonic() + _PATIENCE_S
    while not condition():
        if time.monotonic() > deadline:
            raise LaunchError(f"{wrong} within {_PATIENCE_S:g} s")
        executor.spin_once(timeout_sec=0.1)
