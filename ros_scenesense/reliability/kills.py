"""Random kills: SIGKILL of any node, at any moment of a session in which all of them learn."""

from __future__ import annotations

import os
import signal
import sqlite3
import time
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from ros_scenesense.messages.attention import Examples
from ros_scenesense.messages.grounding import MsrUpdate, Trust
from ros_scenesense.messages.learning import Axioms, JobProgress
from ros_scenesense.reliability.accounting import Accounting, account_for
from ros_scenesense.reliability.outcome import Outcome
from ros_scenesense.reliability.trial import Trial, TrialOptions, running
from ros_scenesense.results import Table
from ros_scenesense.stages.grounding_store import look_into

ACKNOWLEDGED = (Trust, MsrUpdate, Examples, Axioms, JobProgress)
"""Messages by which nodes say that something is learned."""
_SETTLING_S = 180.0
_ALL_SCENES = 10_000
_CHOSEN: dict[str, dict[str, object]] = {
    # What was learned is replayed at the end, from all scenes.
    "grounding": {"remembered_scenes": _ALL_SCENES},
    "grounding_control": {"remembered_scenes": _ALL_SCENES},
    # A short training hardly betters the network that comes with SceneSense: then none is adopted.
    "attention": {"network": "none"},
}


def kill_at_random(
    options: TrialOptions, kills: int, interval_s: float, report: Callable[[str], None]
) -> Outcome:
    """Kills nodes of a running graph, then compares what is on disk with what was acknowledged.

    Every node is killed equally often, in random order, also while it starts again; the moments
    are random.

    Args:
        options: Of the session; its messages and memory are chosen here.
        kills: How many kills.
        interval_s: Mean time between two.
        report: Takes lines for people.

    Raises:
        LaunchError: If a node does not come back.
    """
    values = options.parameters()
    overrides = {name: {**values.get(name, {}), **more} for name, more in _CHOSEN.items()}
    options = replace(options, keep=ACKNOWLEDGED, overrides={**options.overrides, **overrides})
    rng = np.random.default_rng([options.seed, *b"kills"])
    killed: Counter[str] = Counter()
    with running(options, report) as trial:
        victims: list[str] = []
        for _ in range(kills):
            _work(trial, rng.uniform(0.0, 2.0 * interval_s))
            victims = victims or list(map(str, rng.permutation(list(trial.graph.nodes))))
            killed[_kill(trial, victims.pop())] += 1
        settled = trial.settle(_SETTLING_S) and trial.graph.spin_until(
            lambda: _at_rest(trial, options.folder / "state"), _SETTLING_S
        )
        account = trial.companion.account
    if not settled:
        report(f"not everything was settled {_SETTLING_S:g} s after the last kill")
    return _outcome(killed, account_for(account, options.folder / "state"), account.lost)


def _work(trial: Trial, seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        trial.step()


def _kill(trial: Trial, name: str) -> str:
    """Kills a node as the system would that runs out of memory; waits for it if it is dead."""
    process = trial.graph.nodes[name]
    while process.exit_code is not None:
        trial.step()
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    return name


def _at_rest(trial: Trial, state: Path) -> bool:
    """Whether the camera knows what became of its scenes, and grounding has all evidence."""
    with closing(sqlite3.connect(state / "camera.db")) as camera:
        (waiting,) = camera.execute("SELECT count(*) FROM scene WHERE state = 'open'").fetchone()
    sent = max((int(number) for number in trial.companion.account.kept[MsrUpdate]), default=0)
    account = trial.companion.account
    if waiting or account.waiting or account.unanswered:
        return False
    return sent == 0 or look_into(state / "grounding.db").updates >= sent


def _outcome(killed: Counter[str], found: Accounting, lost: dict[str, str]) -> Outcome:
    rows: list[list[str | int | float | None]] = [
        [each.what, each.acknowledged, each.found, len(each.lost), len(each.doubled)]
        for each in found.items
    ]
    problems = [words for each in found.items for words in (*each.lost, *each.doubled)]
    problems += found.corrupted
    tables = {
        "Kills: what nodes had acknowledged, and what is on disk": Table(
            columns=["what", "acknowledged", "on disk", "lost", "doubled"], rows=rows
        ),
        "Kills by node": Table(columns=["node", "kills"], rows=[list(p) for p in killed.items()]),
    }
    if problems:
        tables["Kills: problems"] = Table(columns=["problem"], rows=[[words] for words in problems])
    return Outcome(
        figures={
            "kills": sum(killed.values()),
            "kills_lost_items": sum(len(each.lost) for each in found.items),
            "kills_doubled_items": sum(len(each.doubled) for each in found.items),
            "kills_corrupted_files": len(found.corrupted),
            "kills_scenes_reported_lost": len(lost),
        },
        tables=tables,
    )
