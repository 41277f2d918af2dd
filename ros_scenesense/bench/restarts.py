"""How long a killed node is missed: each is killed in a running graph, one after the other."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from std_msgs.msg import Float32

from ros_scenesense.bench.loop_graph import LoopGraph
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.registry import DEFAULT_NODES

_PATIENCE_S = 60.0
_SCENES_BEFORE = 5


@dataclass(frozen=True)
class Restart:
    """How a node came back after SIGKILL.

    Attributes:
        node: Its name.
        ready_s: Until its new process said that it is ready.
        useful_s: Until it did its work again: a scene that needs it was decided, or, as to the
            axiom learner, was kept to be learned from.
    """

    node: str
    ready_s: float
    useful_s: float


def measure_restarts(folder: Path, seed: int, scenes: int) -> list[Restart]:
    """Kills every node once while the camera simulates scenes to learn from.

    Args:
        folder: For state and logs.
        seed: Of the scenes.
        scenes: So many are settled before: topics keep up to 200 for those who come late.

    Raises:
        LaunchError: If a node does not come back.
    """
    overrides: dict[str, dict[str, object]] = {
        "simulated_camera": {"seed": seed, "mode": "training"},
        "axiom_learner": {"cycle_scenes": 0},
    }
    with LoopGraph(folder, overrides) as loop:
        # Said with every scene that the learner keeps; a heartbeat comes up to 1 s later.
        kept: list[float] = []
        loop.node.create_subscription(
            Float32,
            "timing/axiom_learner/keep",
            lambda message: kept.append(message.data),
            profile_of(QosClass.REQUEST),
        )
        loop.wait_warm(scenes)
        return [_restart(loop, name, kept) for name in DEFAULT_NODES]


def _restart(loop: LoopGraph, name: str, kept: list[float]) -> Restart:
    process = loop.graph.nodes[name]
    settled = len(loop.settled)
    loop.wait_for(
        lambda: len(loop.settled) >= settled + _SCENES_BEFORE, _PATIENCE_S, f"{name}: no scenes"
    )
    assert process.pid is not None
    before = process.pid
    os.kill(before, signal.SIGKILL)
    start = time.monotonic()
    loop.wait_for(
        lambda: process.pid != before and process.ready, _PATIENCE_S, f"{name} is not ready again"
    )
    ready_s = time.monotonic() - start
    # What came before it was ready was under way beyond the killed node already.
    begin = len(loop.settled)
    kept.clear()
    loop.wait_for(
        lambda: _is_useful(loop, name, begin, kept),
        _PATIENCE_S,
        f"{name} is ready but does nothing",
    )
    return Restart(name, ready_s, time.monotonic() - start)


def _is_useful(loop: LoopGraph, name: str, begin: int, kept: list[float]) -> bool:
    if name == "axiom_learner":
        return bool(kept)
    decided = loop.settled[begin:]
    if name == "attention":
        return any(each.estimates.network_revision is not None for each in decided)
    return bool(decided)
