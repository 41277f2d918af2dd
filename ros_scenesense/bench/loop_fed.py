"""The graph without its camera, fed with scenes made before: many objects, and transport alone."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ros_scenesense.bench.crowds import Studio
from ros_scenesense.bench.loop_graph import SCENES_S, LoopGraph
from ros_scenesense.bench.player import Player, Take
from ros_scenesense.bench.transport import (
    forwarded_latencies_ms,
    played_latencies_ms,
    recorded,
)
from ros_scenesense.nodes.registry import DEFAULT_NODES
from ros_scenesense.results import Table
from ros_scenesense.simulation.configuration import SimulationConfiguration

MANY = 20
SLOW_HZ = 8.0
_CROWDS = (5, 10, MANY, 40)
_PICTURES = 8
_IN_FLIGHT = 2
_SESSION = "bench"


@dataclass(frozen=True)
class Fed:
    """What was measured.

    Attributes:
        latencies_ms: Of scenes that come one at a time, by their number of objects.
        per_s_many: Scenes of `MANY` objects per second.
        full_ms: Latencies of the graph, by scenes per second: first at the rate that it reaches
            with two scenes in flight, then at one that leaves it idle in between.
        forwarded_ms: Latencies of nodes that only forward, at the same rates.
    """

    latencies_ms: dict[int, list[float]]
    per_s_many: float
    full_ms: dict[float, list[float]]
    forwarded_ms: dict[float, list[float]]

    def figures(self) -> dict[str, float]:
        """By the names of `loop.FIGURES`."""
        counts = list(self.latencies_ms)
        medians = [float(np.median(self.latencies_ms[count])) for count in counts]
        growth, _ = np.polyfit(np.log(counts), np.log(medians), 1)
        return {
            "transport_share": self._shares()[0],
            "loop_scenes_per_s_20": self.per_s_many,
            "loop_latency_ms_20": float(np.median(self.latencies_ms[MANY])),
            "loop_latency_growth": float(growth),
        }

    def tables(self) -> dict[str, Table]:
        """Latency against objects with its fit, and beside transport alone."""
        fit = fitted(self.latencies_ms)
        rows: list[list[str | int | float | None]] = [
            [count, *_distribution(values), fit[0] + fit[1] * count + fit[2] * count**2]
            for count, values in self.latencies_ms.items()
        ]
        columns = ["scenes", "median ms", "95 % ms"]
        transport: list[list[str | int | float | None]] = [
            [rate, *_distribution(full)[1:], *_distribution(self.forwarded_ms[rate])[1:], share]
            for (rate, full), share in zip(self.full_ms.items(), self._shares(), strict=True)
        ]
        return {
            "Latency against objects, one scene at a time": Table(
                columns=["objects", *columns, "fit, ms"], rows=rows
            ),
            "Fit: ms = a + b objects + c objects^2": Table(columns=["a", "b", "c"], rows=[[*fit]]),
            "Transport": Table(
                columns=[
                    "scenes per s",
                    "all nodes, median ms",
                    "95 % ms",
                    "forwarding, median ms",
                    "95 % ms",
                    "share",
                ],
                rows=transport,
            ),
        }

    def _shares(self) -> list[float]:
        return [
            float(np.median(self.forwarded_ms[rate]) / np.median(full))
            for rate, full in self.full_ms.items()
        ]


def measure_fed(folder: Path, seed: int, takes: Sequence[Take], scenes: int, rated: int) -> Fed:
    """Feeds a graph with pictures of crowds, and with takes at a rate.

    Args:
        folder: For state and logs.
        seed: Of the crowds.
        takes: Scenes of few objects, for transport.
        scenes: How many are shown for each number of objects.
        rated: How many are shown for transport, at each rate.

    Raises:
        LaunchError: If the graph does not do its work.
    """
    crowds = _crowds(seed)
    nodes = tuple(name for name in DEFAULT_NODES if name != "simulated_camera")
    latencies_ms = {}
    with LoopGraph(folder / "graph", {}, nodes) as loop:
        player = Player(loop.node, _SESSION)
        loop.wait_warm()
        loop.wait_for(player.has_audience, SCENES_S, "nobody takes the images")
        # The first scenes of a process are slower.
        recording = recorded(loop, player, takes, rated, SLOW_HZ)
        own_ms, own_hz = _paced(loop, player, takes, rated, _IN_FLIGHT)
        slow_ms = played_latencies_ms(loop, player, takes, rated, SLOW_HZ)
        for count, pictures in crowds.items():
            latencies_ms[count] = _paced(loop, player, pictures, scenes, in_flight=1)[0]
        _, per_s = _paced(loop, player, crowds[MANY], scenes, _IN_FLIGHT)
    full_ms = {own_hz: own_ms, SLOW_HZ: slow_ms}
    forwarded = forwarded_latencies_ms(folder, recording, rated, [*full_ms])
    return Fed(latencies_ms, per_s, full_ms, dict(zip(full_ms, forwarded, strict=True)))


def fitted(latencies_ms: dict[int, list[float]]) -> tuple[float, float, float]:
    """The law a + b n + c n^2 whose relative distance to the medians is least, n objects, ms."""
    medians = np.array([np.median(each) for each in latencies_ms.values()])
    c, b, a = np.polyfit(list(latencies_ms), medians, 2, w=1.0 / medians)
    return float(a), float(b), float(c)


def _crowds(seed: int) -> dict[int, list[Take]]:
    size = SimulationConfiguration()
    rng = np.random.default_rng(seed)
    with closing(Studio(size.width, size.height)) as studio:
        pictures = {
            count: [studio.crowd(count, rng) for _ in range(_PICTURES)] for count in _CROWDS
        }
    return {
        count: [Take(each.frame, each.objects) for each in taken]
        for count, taken in pictures.items()
    }


def _paced(
    loop: LoopGraph, player: Player, takes: Sequence[Take], scenes: int, in_flight: int
) -> tuple[list[float], float]:
    """Latencies, and scenes per second."""
    begin = len(loop.settled)
    player.play(takes, scenes + 1, in_flight)
    loop.wait_for(
        lambda: len(loop.settled) > begin + scenes, SCENES_S, f"not {scenes} scenes are settled"
    )
    settled = loop.settled[begin:]
    per_s = scenes / (settled[-1].at - settled[0].at)
    return [each.latency_ms for each in settled[1:]], per_s


def _distribution(values: Sequence[float]) -> tuple[int, float, float]:
    p50, p95 = np.percentile(values, [50.0, 95.0])
    return len(values), float(p50), float(p95)
