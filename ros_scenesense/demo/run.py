"""Runs the graph on simulated scenes, shows it, and writes the run folder."""

from __future__ import annotations

import shlex
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from ros_scenesense.demo.domains import LAST_DOMAIN, choose_domain
from ros_scenesense.demo.observer import Observer
from ros_scenesense.demo.record import RunRecord
from ros_scenesense.demo.report import write_report
from ros_scenesense.demo.run_folder import make_folder, new_folder
from ros_scenesense.demo.summary import Outcome, RunEnd, RunInfo, Summary, summarise, write_summary
from ros_scenesense.demo.tables import (
    axioms_table,
    final_words,
    latency_line,
    learning_table,
    legend,
    scenes_table,
    totals_table,
)
from ros_scenesense.demo.view import make_view
from ros_scenesense.errors import LaunchError, ParameterError
from ros_scenesense.launcher import Graph, GraphOptions
from ros_scenesense.launcher.options import with_recorder
from ros_scenesense.parameters import parameter
from ros_scenesense.simulation.arrangements import Arrangement

_READY_TIMEOUT_S = 60.0
_POLL_S = 0.1
_GRACE_S = 2.0
_SHOWN_SCENES = 40
_NOT_GIVEN = -1

LEARNING_SCENES = 320
"""Scenes of a run that learns: enough for five cycles, and to see what the last one changed."""

LEARNING = {
    "reasoner": {"withheld": "s1,s2,s3,o1,o2,o3"},
    "attention": {"network": "none"},
    "simulated_camera": {"mode": "training"},
}
"""Parameters of a run that learns; what the user says is stronger."""


@dataclass(frozen=True)
class DemoOptions:
    """What the user may choose; `overrides` are values per node and parameter."""

    scenes: int = parameter(20, "number of scenes", minimum=1, maximum=1000)
    seed: int = parameter(0, "seed of the scenes; same seed, same scenes", minimum=0)
    arrangement: str = parameter(
        "mixed",
        "how objects are arranged; mixed takes the others in turn",
        choices=tuple(Arrangement),
    )
    out: str = parameter("", "run folder; runs/<date and time> if not given")
    domain_id: int = parameter(
        _NOT_GIVEN,
        "ROS domain; if not given ROS_DOMAIN_ID, else one that nobody uses",
        minimum=0,
        maximum=LAST_DOMAIN,
    )
    params: str = parameter("", "params YAML of the nodes; the shipped one if not given")
    timeout: float = parameter(
        _NOT_GIVEN,
        "seconds for all scenes once the nodes are ready; if not given 60 and 5 a scene",
        minimum=1.0,
    )
    record: bool = parameter(False, "record the run into a bag in the run folder")
    learn: bool = parameter(
        False,
        "start without the axioms that are to be learned, and show how they are; "
        f"{LEARNING_SCENES} scenes if not given",
    )
    overrides: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    @property
    def timeout_s(self) -> float:
        """Time for all scenes."""
        return 60.0 + 5.0 * self.scenes if self.timeout == _NOT_GIVEN else self.timeout

    @property
    def command(self) -> str:
        """The command line that repeats the run."""
        words = ["scenesense", "demo"]
        for name in ("scenes", "seed", "arrangement", "params"):
            value = getattr(self, name)
            if value != "":
                words += [f"--{name}", str(value)]
        words += [f"--{name}" for name in ("record", "learn") if getattr(self, name)]
        for node, values in self.overrides.items():
            for name, value in values.items():
                words += ["-p", f"{node}.{name}={value}"]
        return shlex.join(words)


@dataclass(frozen=True)
class DemoResult:
    """What a run gave: its record, its figures, and where they were written."""

    record: RunRecord
    summary: Summary
    folder: Path


class Demo:
    """One run of the graph.

    Args:
        options: What the user chose.
        console: Where it is shown.

    Raises:
        ParameterError: If an option is wrong, or the run folder cannot be made.
    """

    def __init__(self, options: DemoOptions, console: Console) -> None:
        started = datetime.now(UTC)
        domain = None if options.domain_id == _NOT_GIVEN else options.domain_id
        self._options = options
        self._console = console
        self._folder = Path(options.out) if options.out else new_folder(started)
        session = f"{started:%Y%m%dT%H%M%S}-{started.microsecond:06d}"
        self._record = RunRecord(session)
        self._info = RunInfo(
            session=session,
            started=f"{started:%Y-%m-%d %H:%M:%S} UTC",
            command=options.command,
            seed=options.seed,
            arrangement=options.arrangement,
            domain_id=choose_domain(domain),
            asked=options.scenes,
        )
        self._view = make_view(console, self._record, self._info)
        self._graph = Graph(self._graph_options(), report=self._view.event)
        self._ready_ns = 0
        make_folder(self._folder)

    def run(self) -> DemoResult:
        """Runs the graph until all scenes are settled, then writes what was seen.

        Whatever ends the run, what was seen until then is written and shown.

        Raises:
            ParameterError: If a node refuses its parameters; nothing is written then.
        """
        outcome: Outcome = "complete"
        error: str | None = None
        self._view.open()
        try:
            error = self._run_graph()
            outcome = "timed_out" if error else "complete"
        except LaunchError as failure:
            outcome, error = "failed", str(failure)
        except KeyboardInterrupt:
            outcome, error = "interrupted", "stopped by the user"
        finally:
            self._view.close()
        end = RunEnd(outcome, error, self._graph.ready_s, self._scenes_s())
        return self._write(summarise(self._record, self._info, end))

    def _run_graph(self) -> str | None:
        """Returns why not all scenes were seen, or None."""
        self._view.event(f"starting the nodes in ROS domain {self._info.domain_id}")
        with self._graph as graph:
            observer = Observer(
                self._record,
                self._view.update,
                namespace=graph.options.namespace,
                context=graph.context,
            )
            graph.executor.add_node(observer.node)
            try:
                graph.wait_ready(timeout_s=_READY_TIMEOUT_S)
                self._ready_ns = time.time_ns()
                return self._watch(graph)
            finally:
                graph.executor.remove_node(observer.node)
                observer.node.destroy_node()

    def _watch(self, graph: Graph) -> str | None:
        asked = self._info.asked
        timeout_s = self._options.timeout_s
        if graph.spin_until(lambda: len(self._record.settled()) >= asked, timeout_s=timeout_s):
            # What is only shown, an image or a verdict, may still be on its way, and so are the
            # heartbeats with the last counters.
            settled_ns = time.time_ns()
            graph.spin_until(
                lambda: self._record.has_all(asked) and self._record.all_beat_since(settled_ns),
                timeout_s=_GRACE_S,
            )
            return None
        settled = len(self._record.settled())
        hint = ""
        if self._record.foreign:
            hint = f"; another camera shows scenes in ROS domain {self._info.domain_id}"
        return (
            f"only {settled} of {asked} scenes were settled within {timeout_s:g} s{hint}: "
            f"see the logs in {self._folder / 'logs'}"
        )

    def _graph_options(self) -> GraphOptions:
        camera = {
            "scenes": self._options.scenes,
            "seed": self._options.seed,
            "arrangement": self._options.arrangement,
            "session": self._info.session,
        }
        overrides: dict[str, Mapping[str, object]] = dict(self._options.overrides)
        if self._options.learn:
            for node, values in LEARNING.items():
                overrides[node] = {**values, **overrides.get(node, {})}
        chosen = overrides.get("simulated_camera", {})
        for name in camera.keys() & chosen.keys():
            raise ParameterError(
                f"-p simulated_camera.{name}: the demo chooses it; "
                "say --scenes, --seed or --arrangement"
            )
        overrides["simulated_camera"] = {**chosen, **camera}
        options = GraphOptions(
            domain_id=self._info.domain_id,
            parameters_file=Path(self._options.params) if self._options.params else None,
            overrides=overrides,
            state_dir=self._folder / "state",
            log_dir=self._folder / "logs",
        )
        return with_recorder(options, self._folder) if self._options.record else options

    def _scenes_s(self) -> float | None:
        settled_ns = [scene.settled_ns for scene in self._record.settled() if scene.settled_ns]
        if not settled_ns or not self._ready_ns:
            return None
        # The camera may show its first scene before the last heartbeat has said "ready".
        first_ns = min(stamp for scene in self._record.settled() for stamp in scene.stamps_ns)
        return (max(settled_ns) - min(self._ready_ns, first_ns)) / 1e9

    def _write(self, summary: Summary) -> DemoResult:
        write_summary(summary, self._folder / "summary.json")
        write_report(self._record, summary, self._folder / "report.html")
        return DemoResult(self._record, summary, self._folder)


def show_result(result: DemoResult, console: Console) -> None:
    """Prints the tables of a run, and where its files are."""
    summary = result.summary
    scenes = result.record.settled()
    parts = [totals_table(summary.finals), legend(), latency_line(result.record)]
    if summary.learning is not None:
        parts[:0] = [axioms_table(summary.learning), learning_table(summary.learning)]
    if console.is_terminal:  # else every scene has had its line
        parts.insert(0, scenes_table(scenes[-_SHOWN_SCENES:]))
    for part in parts:
        console.print(part)
        console.print()
    console.print(final_words(summary), highlight=False)
    files = [
        ("report ", result.folder / "report.html"),
        ("figures", result.folder / "summary.json"),
    ]
    files += [("bag    ", bag) for bag in sorted(result.folder.glob("bag-*"))]
    for what, file in files:
        console.print(f"{what}  {file}", markup=False, highlight=False, soft_wrap=True)
