"""Experiment on backgrounds: the same scenes before few and before many different backgrounds.

Paper, second set of experiments: the more backgrounds, the more a network that sees whole images
has to tell what matters from what does not; one that is led by attention hardly notices.
"""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ros_scenesense.experiments.comparison import Comparison, Summary
from ros_scenesense.experiments.estimation import (
    Options,
    Say,
    check_ways,
    dataset_of,
    look,
    try_all,
)
from ros_scenesense.experiments.estimation_plans import BACKGROUNDS, QUICK_BACKGROUNDS
from ros_scenesense.experiments.estimation_trials import Tried
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.plots import Panel, Series
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import Result, Table
from ros_scenesense.simulation.backgrounds import PLAIN
from ros_scenesense.simulation.engine import SimulationConfiguration

COUNTS = (10, 30, 50, 100)
_QUICK_COUNTS = (2, 10)

Accuracies = dict[tuple[str, int], dict[int, list[float]]]
"""By way and training images, then by backgrounds; one for each repetition."""


def conduct(options: Options, say: Say) -> Outcome:
    """Runs the experiment.

    Args:
        options: How. A dataset that is given should have plain backgrounds.
        say: Takes a line when something has been done.

    Raises:
        DatasetError: If the dataset is none, or too small.
        NetworkError: If the scenes cannot teach anything.
        ParameterError: If a way is none.
    """
    from ros_scenesense.simulation.dataset.rebackground import rebackground

    check_ways(options.ways)
    plan = QUICK_BACKGROUNDS if options.quick else BACKGROUNDS
    counts = _QUICK_COUNTS if options.quick else COUNTS
    plain = SimulationConfiguration(backgrounds=PLAIN)
    found: Accuracies = defaultdict(dict)
    scenes = 0
    with tempfile.TemporaryDirectory() as folder, dataset_of(options, plan, say, plain) as source:
        for count in counts:
            dataset = Path(folder) / f"dataset_{count}"
            rebackground(source, dataset, count, options.jobs)
            work = (options.work or Path(folder)) / f"backgrounds_{count}"
            scenes = look(dataset, work, plan, options, say)
            say(f"{count} backgrounds:")
            _add(found, count, try_all(work, scenes, plan, options, say))
    return report_on(found, options, scenes, plan.tests(scenes))


def report_on(found: Accuracies, options: Options, scenes: int, tests: int) -> Outcome:
    """Summarises accuracies.

    Args:
        found: The accuracies.
        options: Of the run.
        scenes: How many there were.
        tests: How many of them were tested on.
    """
    counts = sorted({count for each in found.values() for count in each})
    figures = {
        f"{way}_{images}_backgrounds_{count}": round(float(np.mean(values)), 4)
        for (way, images), each in found.items()
        for count, values in each.items()
    }
    spreads = {key: _spread(each) for key, each in found.items()}
    figures |= {
        f"{way}_{images}_background_spread": round(spread, 2)
        for (way, images), spread in spreads.items()
    }
    ours = [images for way, images in found if way == "query"]
    if ours:
        figures["background_spread"] = round(spreads["query", max(ours)], 2)
    result = Result(
        name=options.experiment,
        command=options.command,
        seed=options.seed,
        versions=versions(),
        machine=machine(),
        figures=figures,
        notes=[
            f"The same {scenes} simulated scenes were put before {', '.join(map(str, counts))} "
            f"different backgrounds; the last {tests} of them test. Knowledge lacks the six axioms "
            "that are to be learned. Accuracy is of the occlusion of objects and the stability of "
            "structures. The spread is that between the best and the worst number of backgrounds, "
            "in points; `background_spread` is that of the architecture (`query`) with the most "
            "images. Grounding and reasoning do not see colours, so they do not change."
        ],
        tables={"Accuracy, % ± 95 %, by the number of backgrounds": _table(found, counts)},
    )
    series = [
        Series(
            f"{way}, {images} images",
            [100.0 * float(np.mean(each[count])) if count in each else None for count in counts],
            [100.0 * Summary.of(each[count]).margin if count in each else None for count in counts],
        )
        for (way, images), each in found.items()
    ]
    labels = [str(count) for count in counts]
    panel = Panel("accuracy", labels, series, "accuracy, %", "backgrounds", lines=True)
    return Outcome(result, [panel])


def _add(found: Accuracies, count: int, tried: Sequence[Tried]) -> None:
    for one in tried:
        trial = one.trial
        if trial.way in one.scores:
            several = found[trial.way, trial.images].setdefault(count, [])
            several.append(one.scores[trial.way]["accuracy"])


def _spread(by_count: Mapping[int, Sequence[float]]) -> float:
    """Points between the best and the worst."""
    return 100.0 * float(np.ptp([float(np.mean(each)) for each in by_count.values()]))


def _table(found: Accuracies, counts: Sequence[int]) -> Table:
    rows: list[list[str | int | float | None]] = []
    for (way, images), each in found.items():
        summaries = [Summary.of(each[count]) for count in counts]
        cells = [f"{100 * one.mean:.1f} ± {100 * one.margin:.1f}" for one in summaries]
        fewer = Comparison.of(each[counts[0]], each[counts[-1]])
        rows.append([way, images, *cells, round(_spread(each), 1), fewer.verdict])
    columns = ["way", "images", *map(str, counts), "spread", "fewest better than most, at 95 %"]
    return Table(columns=columns, rows=rows)
