"""The whole graph, run where nobody else hears it, and a node that listens to its estimates."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import rclpy
from std_msgs.msg import String

from ros_scenesense.demo.domains import choose_domain
from ros_scenesense.errors import LaunchError
from ros_scenesense.launcher import Graph, GraphOptions
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.scenes import SceneLost
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.registry import DEFAULT_NODES
from ros_scenesense.results import Table

WARM_S = 120.0
SCENES_S = 120.0
HERE = "launcher and listener"


@dataclass(frozen=True)
class Settled:
    """A scene whose estimates came.

    Attributes:
        at: When they came, seconds on the steady clock.
        latency_ms: From the stamp of the frame until then.
        estimates: What was decided.
    """

    at: float
    latency_ms: float
    estimates: Estimates


@dataclass(frozen=True)
class Pace:
    """How a running graph went through scenes.

    Attributes:
        per_s: Scenes per second, from the estimates of one scene to those of the last.
        latencies_ms: From the stamp of each frame to its estimates.
        cpu_ms: CPU time per scene of each node and of its worker, by name.
    """

    per_s: float
    latencies_ms: list[float]
    cpu_ms: dict[str, float]

    def latency_ms(self, percent: float) -> float:
        """A percentile of the latencies."""
        return float(np.percentile(self.latencies_ms, percent))


class LoopGraph:
    """The running graph; a context manager.

    Args:
        folder: For state and logs.
        overrides: Values per node and parameter.
        nodes: Which nodes are started.

    Attributes:
        graph: The launcher.
        node: Listens; others may give it topics of their own.
        settled: Scenes in the order of their estimates.
        lost: Ids of the scenes that the camera gave up.
    """

    node: Any

    def __init__(
        self,
        folder: Path,
        overrides: Mapping[str, Mapping[str, object]],
        nodes: tuple[str, ...] = DEFAULT_NODES,
    ) -> None:
        self.settled: list[Settled] = []
        self.lost: list[str] = []
        self.graph = Graph(
            GraphOptions(
                nodes=nodes,
                domain_id=choose_domain(None),
                overrides=overrides,
                state_dir=folder / "state",
                log_dir=folder / "logs",
            )
        )

    def __enter__(self) -> LoopGraph:
        self.graph.start()
        try:
            self.node = rclpy.create_node(
                "listener", namespace=self.graph.options.namespace, context=self.graph.context
            )
            for message, take in ((Estimates, self._settle), (SceneLost, self._lose)):
                topic = TOPICS[message]
                self.node.create_subscription(String, topic.name, take, profile_of(topic.qos))
            self.graph.executor.add_node(self.node)
        except BaseException:
            self.graph.stop()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.graph.executor.remove_node(self.node)
        self.node.destroy_node()
        self.graph.stop()

    def wait_warm(self, settled: int = 0) -> None:
        """Waits until all workers take jobs, and so many scenes are settled.

        Raises:
            LaunchError: If that takes too long, or a node cannot run.
        """
        self.graph.wait_ready()
        self.wait_for(
            lambda: (
                len(self.settled) >= settled
                and all(each.heartbeat and each.heartbeat.warm for each in self._processes())
            ),
            WARM_S,
            "not all workers are warm",
        )

    def pace(self, scenes: int) -> Pace:
        """Watches the graph go through so many scenes more.

        Raises:
            LaunchError: If scenes are lost, or that takes too long.
        """
        first = len(self.settled)
        self.wait_for(lambda: len(self.settled) > first, SCENES_S, "no scene is settled")
        before = self.cpu_by_process()
        begin = len(self.settled)
        end = begin + scenes
        self.wait_for(
            lambda: len(self.settled) >= end, SCENES_S, f"not {scenes} scenes are settled"
        )
        after = self.cpu_by_process()
        if self.lost:
            raise LaunchError(f"the graph lost {len(self.lost)} scenes, first {self.lost[0]}")
        seen = len(self.settled) - begin
        return Pace(
            per_s=scenes / (self.settled[end - 1].at - self.settled[begin - 1].at),
            latencies_ms=[each.latency_ms for each in self.settled[begin:end]],
            cpu_ms={name: 1e3 * (after[name] - before.get(name, 0.0)) / seen for name in after},
        )

    def wait_for(self, condition: Callable[[], object], timeout_s: float, wrong: str) -> None:
        """Polls the graph until a condition holds.

        Raises:
            LaunchError: With what is wrong if it does not in time.
        """
        if not self.graph.spin_until(lambda: bool(condition()), timeout_s):
            raise LaunchError(f"{wrong} within {timeout_s:g} s: see {self.graph.log_dir}")

    def cpu_by_process(self) -> dict[str, float]:
        """CPU time so far of each node, of its worker, and of this process."""
        seconds = {HERE: time.process_time()}
        for process in self._processes():
            if process.pid is not None:
                seconds[process.name] = cpu_s(process.pid)
                for child in children_of(process.pid):
                    name = f"{process.name}, worker"
                    seconds[name] = seconds.get(name, 0.0) + cpu_s(child)
        return seconds

    def _processes(self) -> list[Any]:
        return list(self.graph.nodes.values())

    def _settle(self, message: String) -> None:
        now_ns = time.time_ns()
        estimates = decode(message.data, Estimates)
        latency_ms = (now_ns - estimates.stamp.nanoseconds) / 1e6
        self.settled.append(Settled(time.monotonic(), latency_ms, estimates))

    def _lose(self, message: String) -> None:
        self.lost.append(decode(message.data, SceneLost).scene_id)


def cpu_table(paces: Mapping[str, Pace]) -> Table:
    """CPU time per scene: a row for each process, a column for each run."""
    names = list(dict.fromkeys(name for pace in paces.values() for name in pace.cpu_ms))
    rows: list[list[str | int | float | None]] = [
        [name, *(pace.cpu_ms.get(name) for pace in paces.values())] for name in names
    ]
    rows.append(["all", *(sum(pace.cpu_ms.values()) for pace in paces.values())])
    return Table(columns=["process", *(f"{title}, ms" for title in paces)], rows=rows)


def cpu_s(process_id: int) -> float:
    """CPU time that a process has used so far; 0 if there is none of this id."""
    with suppress(OSError):
        fields = Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def children_of(process_id: int) -> list[int]:
    """All processes that a process has started, and those that they have."""
    found = []
    with suppress(OSError):
        for thread in Path(f"/proc/{process_id}/task").iterdir():
            for child in (thread / "children").read_text().split():
                found += [int(child), *children_of(int(child))]
    return found
