"""The whole loop on the graph: how fast, how late, how much of that is transport, and restarts.

All nodes take part, the attention network and the axiom learner too; nothing is trained meanwhile.
The clock starts when all workers are warm and the first scenes are settled.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.bench.loop_fed import measure_fed
from ros_scenesense.bench.loop_graph import LoopGraph, Pace, cpu_table
from ros_scenesense.bench.player import Take
from ros_scenesense.bench.restarts import Restart, measure_restarts
from ros_scenesense.results import Table
from ros_scenesense.simulation.dataset import images
from ros_scenesense.simulation.dataset.folder import MadeScene
from ros_scenesense.simulation.dataset.generation import write_missing
from ros_scenesense.simulation.dataset.metadata import DatasetOptions, describe
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.dataset.record import record_of
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine

FIGURES = (
    Figure(
        "loop_scenes_per_s",
        "scenes of 5 objects per second through the whole graph, played from a dataset",
        at_least=8.0,
    ),
    Figure(
        "loop_scenes_per_s_simulating",
        "scenes per second while the camera simulates, the slower of two arrangements",
        at_least=5.0,
    ),
    Figure(
        "loop_latency_p95_ms",
        "stamp of a frame until its estimates, 95th percentile, the latest of these runs, ms",
        at_most=400.0,
    ),
    Figure("loop_cpu_ms", "CPU time per scene played, all processes, ms"),
    Figure("loop_cpu_ms_simulating", "the same per scene simulated, ms"),
    Figure(
        "transport_share",
        "median latency of nodes that only forward the same messages, over that of the graph",
        at_most=0.15,
    ),
    Figure("loop_scenes_per_s_20", "scenes of 20 objects per second", at_least=2.0),
    Figure("loop_latency_ms_20", "latency of such a scene, one at a time, median, ms"),
    Figure("loop_latency_growth", "exponent of the number of objects with which latency grows"),
    Figure(
        "restart_s",
        "a killed node does its work again after so long, the slowest but attention, s",
        at_most=3.0,
    ),
    Figure("restart_attention_s", "attention's network answers again, s", at_most=6.0),
)
_OBJECTS = 5
_SETTLED_BEFORE = 10


@dataclass(frozen=True)
class _Size:
    """How many scenes are shown."""

    paced: int
    crowd: int
    rated: int
    before_kills: int


_FULL = _Size(paced=100, crowd=40, rated=60, before_kills=200)
_QUICK = _Size(paced=10, crowd=5, rated=8, before_kills=10)


def measure(options: BenchOptions) -> Measured:
    """Runs the graph in temporary folders, five times in all.

    Raises:
        LaunchError: If a graph does not do its work.
    """
    size = _QUICK if options.quick else _FULL
    with tempfile.TemporaryDirectory(prefix="scenesense-") as name:
        folder = Path(name)
        dataset = folder / "dataset"
        make_dataset(dataset, size.paced + 2 * _SETTLED_BEFORE, options.seed)
        played = _pace(folder / "played", size, options.seed, dataset=str(dataset))
        simulated = {
            f"simulated, {each}": _pace(folder / each, size, options.seed, arrangement=each)
            for each in ("mixed", "spread")
        }
        takes = [Take(scene.frame, scene.objects) for scene in DatasetReader(dataset)[: size.rated]]
        fed = measure_fed(folder / "fed", options.seed, takes, size.crowd, size.rated)
        restarts = measure_restarts(folder / "kills", options.seed, size.before_kills)
    runs = {"played": played, **simulated}
    slowest = min(simulated.values(), key=lambda pace: pace.per_s)
    return Measured(
        figures={
            "loop_scenes_per_s": played.per_s,
            "loop_scenes_per_s_simulating": slowest.per_s,
            "loop_latency_p95_ms": max(pace.latency_ms(95.0) for pace in runs.values()),
            "loop_cpu_ms": sum(played.cpu_ms.values()),
            "loop_cpu_ms_simulating": sum(slowest.cpu_ms.values()),
            **fed.figures(),
            **restart_figures(restarts),
        },
        tables={
            f"The loop, {size.paced} scenes": _pace_table(runs),
            "CPU time per scene": cpu_table(runs),
            **fed.tables(),
            "Nodes killed and restarted": _restart_table(restarts),
        },
    )


def make_dataset(path: Path, count: int, seed: int) -> None:
    """Makes a dataset of scenes of all arrangements that have five objects each."""
    metadata = describe(SimulationConfiguration(), DatasetOptions(count=count, seed=seed))

    def make(missing: Sequence[int]) -> Iterator[MadeScene]:
        with closing(SimulationEngine(metadata.configuration)) as engine:
            index = 0
            for number in missing:
                while len((scene := engine.scene(seed, index)).objects) != _OBJECTS:
                    index += 1
                index += 1
                line = msgspec.json.encode(record_of(number, scene))
                yield MadeScene(number, line, images.encode(scene.frame))

    write_missing(path, metadata, make)


def restart_figures(restarts: Sequence[Restart]) -> dict[str, float]:
    """The slowest restart but that of attention, and that."""
    useful_s = {each.node: each.useful_s for each in restarts}
    attention_s = useful_s.pop("attention")
    return {"restart_s": max(useful_s.values()), "restart_attention_s": attention_s}


def _pace(folder: Path, size: _Size, seed: int, **camera: str) -> Pace:
    overrides: dict[str, dict[str, object]] = {
        "simulated_camera": {"seed": seed, "mode": "training", **camera},
        "axiom_learner": {"cycle_scenes": 0},
    }
    with LoopGraph(folder, overrides) as loop:
        loop.wait_warm(_SETTLED_BEFORE)
        return loop.pace(size.paced)


def _pace_table(runs: Mapping[str, Pace]) -> Table:
    rows: list[list[str | int | float | None]] = [
        [name, pace.per_s, *(pace.latency_ms(percent) for percent in (50.0, 95.0, 100.0))]
        for name, pace in runs.items()
    ]
    columns = ["camera", "scenes per s", "latency, median ms", "95 % ms", "longest ms"]
    return Table(columns=columns, rows=rows)


def _restart_table(restarts: Sequence[Restart]) -> Table:
    rows: list[list[str | int | float | None]] = [
        [each.node, each.ready_s, each.useful_s] for each in restarts
    ]
    return Table(columns=["node", "ready again, s", "does its work again, s"], rows=rows)
