"""Experiment on backgrounds: the same scenes before few and before many different backgrounds.

Paper, second set of experiments: the more backgrounds, the more a network that sees whole images
has to tell what matters from what does not; one that is led by attention hardly notices.
"""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ros_scenesense.experiments.comparison import Comparison, Summary
from ros_scenesense.experiments.estimation import (
    SCENES_PER_FILE,
    EstimationOptions,
    Say,
    check_ways,
    claim,
    look_in_parts,
    try_all,
    wanted,
)
from ros_scenesense.experiments.estimation_plans import BACKGROUNDS, QUICK_BACKGROUNDS, Plan
from ros_scenesense.experiments.estimation_scenes import NOISE, Looker, keep
from ros_scenesense.experiments.estimation_trials import Tried
from ros_scenesense.experiments.estimation_views import View
from ros_scenesense.experiments.options import dataset_of
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.plots import Panel, Series
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import Result, Table
from ros_scenesense.simulation.backgrounds import PLAIN, recomposite
from ros_scenesense.simulation.engine import SimulatedScene, SimulationConfiguration
from ros_scenesense.stages.camera_engine import PlayingEngine

COUNTS = (10, 100, 1000)
_QUICK_COUNTS = (2, 10)

Accuracies = dict[tuple[str, int], dict[int, list[float]]]
"""By way and training images, then by backgrounds; one for each repetition."""


def conduct(options: EstimationOptions, say: Say) -> Outcome:
    """Runs the experiment.

    Args:
        options: How. A dataset that is given should have plain backgrounds: from others, the light
            on the table is only as exact as its pixels.
        say: Takes a line when something has been done.

    Raises:
        DatasetError: If the dataset is none, or too small.
        NetworkError: If the scenes cannot teach anything.
        ParameterError: If a way is none.
    """
    check_ways(options.ways)
    plan = QUICK_BACKGROUNDS if options.quick else BACKGROUNDS
    counts = _QUICK_COUNTS if options.quick else COUNTS
    plain = SimulationConfiguration(backgrounds=PLAIN)
    found: Accuracies = defaultdict(dict)
    scenes = 0
    count = options.scenes or plan.scenes
    with (
        tempfile.TemporaryDirectory() as folder,
        dataset_of(options, count, say, plain) as source,
    ):
        work = options.work or Path(folder)
        scenes = _look(source, work, counts, plan, options, say)
        for count in counts:
            say(f"{count} backgrounds:")
            _add(found, count, try_all(work / _folder(count), scenes, plan, options, say))
    return report_on(found, options, scenes, plan.tests(scenes))


def look_before(dataset: Path, numbers: Sequence[int], seed: int, files: Mapping[int, Path]) -> int:
    """Looks at scenes before different backgrounds and keeps them; how many, for who waits.

    Grounding and reasoning do not see colours: each scene is looked at once, and its pixels are cut
    out of several images.

    Args:
        dataset: Of the scenes.
        numbers: The scenes.
        seed: Of the depth noise, and of which scene has which background.
        files: Where they are kept, by the number of backgrounds that there are.
    """
    from ros_scenesense.simulation.dataset.reader import DatasetReader

    reader = DatasetReader(dataset)
    looker = Looker(PlayingEngine(dataset, NOISE), seed, ["incomplete"])
    views: dict[int, list[View]] = {count: [] for count in files}
    try:
        for number in numbers:
            scene, seen = looker.see(number)
            clean = reader[number].frame
            for count, several in views.items():
                chosen = np.random.default_rng([seed, number, count]).integers(1, count + 1)
                color = recomposite(clean, int(chosen), scene.background)
                before = {
                    name: replace(each, frame=replace(each.frame, color=color))
                    for name, each in seen.items()
                }
                several.append(looker.view(number, _colored(scene, color), before))
    finally:
        looker.close()
    for count, file in files.items():
        keep(views[count], file)
    return len(numbers)


def _colored(scene: SimulatedScene, color: npt.NDArray[np.uint8]) -> SimulatedScene:
    return replace(scene, frame=replace(scene.frame, color=color))


def _look(
    dataset: Path,
    work: Path,
    counts: Sequence[int],
    plan: Plan,
    options: EstimationOptions,
    say: Say,
) -> int:
    """Shows scenes to the loop before all numbers of backgrounds; gives how many scenes."""
    whose, numbers = wanted(dataset, plan, options)
    for count in counts:
        claim(work / _folder(count), whose)
    tasks = []
    for start in range(0, len(numbers), SCENES_PER_FILE):
        files = {count: work / _folder(count) / f"{start:06d}.joblib" for count in counts}
        if not all(file.exists() for file in files.values()):
            part = numbers[start : start + SCENES_PER_FILE]
            tasks.append(partial(look_before, dataset, part, options.seed, files))
    look_in_parts(tasks, len(numbers), options.jobs, say)
    return len(numbers)


def _folder(count: int) -> str:
    return f"backgrounds_{count}"


def report_on(found: Accuracies, options: EstimationOptions, scenes: int, tests: int) -> Outcome:
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
