"""The whole graph: real nodes, from the start of the launcher to the last scene."""

from __future__ import annotations

import io
import tempfile

from rich.console import Console

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.demo.run import Demo, DemoOptions
from ros_scenesense.errors import LaunchError
from ros_scenesense.results import Table

FIGURES = (
    Figure("graph_ready_s", "start of the launcher until all nodes are ready, s", at_most=6.0),
    Figure("graph_scenes_per_s", "scenes per second through the graph", at_least=1.0),
    Figure("graph_latency_ms", "stamp of a frame until its estimates, median, ms"),
)


def measure(options: BenchOptions) -> Measured:
    """Runs the demo where nobody sees it.

    Raises:
        LaunchError: If not all scenes went through the graph.
    """
    scenes = 5 if options.quick else 20
    with tempfile.TemporaryDirectory() as folder:
        demo = Demo(
            DemoOptions(scenes=scenes, seed=options.seed, out=folder), Console(file=io.StringIO())
        )
        summary = demo.run().summary
    if summary.outcome == "interrupted":
        raise KeyboardInterrupt
    if summary.outcome != "complete" or summary.scenes < scenes:
        reason = summary.error or f"{summary.lost} of {scenes} scenes were lost"
        raise LaunchError(f"the graph did not complete its scenes: {reason}")
    assert summary.ready_s is not None
    assert summary.scenes_per_s is not None
    assert summary.end_to_end is not None
    latencies = {"frame to decision": summary.end_to_end, **summary.latency}
    rows: list[list[str | int | float | None]] = [
        [name, latency.count, latency.p50_ms, latency.p95_ms] for name, latency in latencies.items()
    ]
    return Measured(
        figures={
            "graph_ready_s": summary.ready_s,
            "graph_scenes_per_s": summary.scenes_per_s,
            "graph_latency_ms": summary.end_to_end.p50_ms,
        },
        tables={
            f"Latency on the graph, {scenes} scenes": Table(
                columns=["step", "count", "median ms", "95 % ms"], rows=rows
            )
        },
    )
