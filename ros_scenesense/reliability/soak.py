"""The soak: the whole graph at work for a long time, the memory of its nodes sampled."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ros_scenesense.errors import LaunchError
from ros_scenesense.plots import Panel, Series
from ros_scenesense.reliability.memory import Growth, Sample, growth, tree_mib
from ros_scenesense.reliability.outcome import Outcome
from ros_scenesense.reliability.trial import Trial, TrialOptions, running
from ros_scenesense.results import Table

_SETTLING_S = 120.0
_SAMPLES = 360
_SHORTEST_PERIOD_S = 0.5
_BINS = 60
_LABELLED_BINS = 10


@dataclass(frozen=True)
class Soak:
    """What was seen of a soak.

    Attributes:
        minutes: How long it ran.
        scenes: Scenes that were shown.
        decided: Those that got their estimates.
        waiting: Those that were neither decided nor reported as lost.
        restarts: How often a node had to be started again.
        learned: What the nodes counted of learning, in words.
        samples: Of the memory.
    """

    minutes: float
    scenes: int
    decided: int
    waiting: int
    restarts: int
    learned: dict[str, int]
    samples: Sequence[Sample]


def soak(options: TrialOptions, minutes: float, report: Callable[[str], None]) -> Soak:
    """Runs the graph on labelled scenes, with feedback and learning.

    The samples are also written to `memory.csv` in the folder, as they come.

    Raises:
        LaunchError: If a node cannot start, or so short a run gave too few samples.
    """
    period_s = max(_SHORTEST_PERIOD_S, 60.0 * minutes / _SAMPLES)
    samples: list[Sample] = []
    with running(options, report) as trial, (options.folder / "memory.csv").open("w") as file:
        writer = csv.writer(file)
        writer.writerow(["elapsed_s", *trial.graph.nodes])
        start = time.monotonic()
        while (elapsed_s := time.monotonic() - start) < 60.0 * minutes:
            trial.step()
            if elapsed_s >= len(samples) * period_s:
                samples.append(_sample(trial, elapsed_s))
                writer.writerow([f"{elapsed_s:.1f}", *map(_rounded, samples[-1].mib.values())])
                file.flush()
        trial.settle(_SETTLING_S)
        account = trial.companion.account
        decided = sum(each in account.decided for each in account.shown)
        if len(samples) < 10:
            raise LaunchError(f"a soak of {minutes:g} minutes is too short to tell growth")
        return Soak(
            minutes=minutes,
            scenes=len(account.shown),
            decided=decided,
            waiting=len(account.waiting),
            restarts=trial.restarts,
            learned={
                "feedback accepted": account.total("grounding_control", "feedback_accepted"),
                "updates of the histograms": account.total("grounding", "updates_applied"),
                "examples": account.total("attention", "examples"),
                "cycles of the axiom learner": account.total("axiom_learner", "cycles"),
                "networks trained": account.total("attention", "networks_adopted")
                + account.total("attention", "networks_rejected"),
            },
            samples=samples,
        )


def outcome_of(found: Soak) -> Outcome:
    """The figures, tables and plot of a soak."""
    grown = growth(found.samples)
    rows: list[list[str | int | float | None]] = [
        [name, _rounded(each.warm_mib), _rounded(each.end_mib), round(each.percent, 2)]
        for name, each in grown.items()
    ]
    said: list[list[str | int | float | None]] = [
        ["minutes", found.minutes],
        ["scenes shown", found.scenes],
        ["scenes decided", found.decided],
        ["restarts of nodes", found.restarts],
    ]
    said += [[what, count] for what, count in found.learned.items()]
    return Outcome(
        figures={
            "soak_minutes": round(found.minutes, 2),
            "soak_scenes": found.scenes,
            "soak_lost_scenes": found.scenes - found.decided,
            "soak_restarts": found.restarts,
            "soak_growth_pct": round(_largest(grown), 2),
        },
        tables={
            "Soak": Table(columns=["what", "number"], rows=said),
            "Soak: memory of the nodes": Table(
                columns=["node", "after warm-up, MiB", "at the end, MiB", "growth, %"], rows=rows
            ),
        },
    )


def panels_of(samples: Sequence[Sample]) -> list[Panel]:
    """Memory over time, and relative to the one after the warm-up."""
    names = list(samples[-1].mib)
    warm = {name: each.warm_mib for name, each in growth(samples).items()}
    bins = [_bin(samples, number) for number in range(min(_BINS, len(samples)))]
    labels = [
        f"{chunk[0].elapsed_s / 60:.0f}" if number % _LABELLED_BINS == 0 else ""
        for number, chunk in enumerate(bins)
    ]
    absolute = [Series(name, [_mean(chunk, name) for chunk in bins]) for name in names]
    relative = [
        Series(name, [100.0 * (_mean(chunk, name) / warm[name] - 1.0) for chunk in bins])
        for name in names
    ]
    return [
        Panel("Memory of each node", labels, absolute, "MiB", "minutes", lines=True, lowest=0.0),
        Panel("... against that after the warm-up", labels, relative, "%", "minutes", lines=True),
    ]


def read_samples(file: Path) -> list[Sample]:
    """The samples that a soak has written."""
    with file.open() as opened:
        return [
            Sample(float(row.pop("elapsed_s")), {name: float(value) for name, value in row.items()})
            for row in csv.DictReader(opened)
        ]


def _sample(trial: Trial, elapsed_s: float) -> Sample:
    mib = {
        name: tree_mib(process.pid)
        for name, process in trial.graph.nodes.items()
        if process.pid is not None
    }
    return Sample(elapsed_s, mib)


def _bin(samples: Sequence[Sample], number: int) -> Sequence[Sample]:
    bins = min(_BINS, len(samples))
    return samples[number * len(samples) // bins : (number + 1) * len(samples) // bins]


def _mean(samples: Sequence[Sample], name: str) -> float:
    return sum(sample.mib[name] for sample in samples) / len(samples)


def _largest(grown: dict[str, Growth]) -> float:
    return max(each.percent for each in grown.values())


def _rounded(value: float) -> float:
    return round(value, 1)
