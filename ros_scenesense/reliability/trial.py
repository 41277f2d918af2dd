"""A graph under trial: real nodes that learn from labelled scenes, and a companion beside them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from ros_scenesense.demo.domains import choose_domain
from ros_scenesense.launcher import Graph, GraphOptions
from ros_scenesense.launcher.options import with_recorder
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.nodes.registry import RECORDER
from ros_scenesense.reliability.companion import Companion

SESSION = "trial"
_READY_S = 120.0
_POLL_S = 0.05
# Something to learn: two axioms are kept back, and what is undecided trains the network.
_LEARNING: dict[str, dict[str, object]] = {
    "simulated_camera": {"mode": "training", "autostart": False, "session": SESSION},
    "reasoner": {"withheld": "s3, o3"},
    "attention": {"train_every": 60, "iterations": 60, "pool_examples": 300},
    # Everything is recorded but the images: an hour of them would be 75 GB.
    RECORDER: {"leave_out": "camera/*, segmentation, cloud, annotated_image", "file_mb": 10},
    "axiom_learner": {"cycle_scenes": 30, "merge_scenes": 5, "trees": 20},
}


@dataclass(frozen=True)
class TrialOptions:
    """How a graph is tried.

    Attributes:
        folder: For state and logs; a state that is there is continued.
        seed: Of scenes and of all that is random.
        rate_hz: Scenes asked for per second.
        feedback_share: Share of the scenes that something is said about.
        domain_id: ROS domain; None = one that nobody uses.
        record: Whether there is a recorder, too.
        keep: Types of messages that the companion keeps whole.
        overrides: Parameters, stronger than those of a trial.
    """

    folder: Path
    seed: int = 0
    rate_hz: float = 1.0
    feedback_share: float = 0.3
    domain_id: int | None = None
    record: bool = False
    keep: tuple[type[AnyMessage], ...] = ()
    overrides: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    def parameters(self) -> dict[str, dict[str, object]]:
        """The parameters by node."""
        values = {name: dict(section) for name, section in _LEARNING.items()}
        values["simulated_camera"]["seed"] = self.seed
        if not self.record:
            del values[RECORDER]
        for name, section in self.overrides.items():
            values[name] = {**values.get(name, {}), **section}
        return values


class Trial:
    """A running graph and its companion; made by `running`.

    Attributes:
        graph: The nodes.
        companion: What they are asked and told, and what was seen of them.
    """

    def __init__(self, graph: Graph, companion: Companion, options: TrialOptions) -> None:
        self.graph = graph
        self.companion = companion
        self._period_s = 1.0 / options.rate_hz
        self._next_scene = time.monotonic()

    @property
    def restarts(self) -> int:
        """How often a node was started again."""
        return sum(process.restarts for process in self.graph.nodes.values())

    def step(self) -> None:
        """Waits a moment for what comes; asks for a scene when one is due.

        Raises:
            LaunchError: If a node died too often.
        """
        self.graph.poll(_POLL_S)
        self.companion.repeat_feedback()
        if time.monotonic() >= self._next_scene and self.companion.ask_for_scene():
            self._next_scene = max(self._next_scene + self._period_s, time.monotonic() - 1.0)

    def settle(self, timeout_s: float) -> bool:
        """Waits until every scene is decided or lost, and every word answered."""
        account = self.companion.account

        def settled() -> bool:
            self.companion.repeat_feedback()
            return not account.waiting and not account.unanswered

        return self.graph.spin_until(settled, timeout_s)


@contextmanager
def running(
    options: TrialOptions, report: Callable[[str], None] = lambda _line: None
) -> Iterator[Trial]:
    """A graph that is ready, and its companion.

    Raises:
        LaunchError: If it does not get ready.
    """
    values = options.parameters()
    recording = values.pop(RECORDER, {})
    graph_options = GraphOptions(
        domain_id=choose_domain(options.domain_id),
        overrides=values,
        state_dir=options.folder / "state",
        log_dir=options.folder / "logs",
    )
    if options.record:
        graph_options = with_recorder(graph_options, options.folder / "bags")
        overrides = dict(graph_options.overrides)
        overrides[RECORDER] = {**overrides[RECORDER], **recording}
        graph_options = replace(graph_options, overrides=overrides)
    graph = Graph(graph_options, report=report)
    with graph:
        companion = Companion(
            options.seed,
            options.feedback_share,
            options.keep,
            context=graph.context,
            namespace=graph.options.namespace,
        )
        graph.executor.add_node(companion.node)
        try:
            graph.wait_ready(_READY_S)
            yield Trial(graph, companion, options)
        finally:
            graph.executor.remove_node(companion.node)
            companion.node.destroy_node()
