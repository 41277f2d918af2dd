"""Experiment on grounding, hypothesis H1 of the paper: both groundings together beat each alone.

Paper, section *Incremental Grounding* and table of the three schemes. Ten disjoint sets are made,
simulated or out of a user's copy of the Table Object Scene Database; on each, everything is taught
and tested anew. What is added to the paper: the qualitative model alone in four variants, pairs
that even people find ambiguous kept apart, distances, changes of the viewpoint, wrong feedback.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ros_scenesense.errors import DatasetError
from ros_scenesense.experiments.grounding_report import Setting, report_on
from ros_scenesense.experiments.grounding_scenes import ObservedScene
from ros_scenesense.experiments.grounding_set import (
    QUICK,
    Measured,
    Plan,
    measure_schemes,
    measure_simulated,
)
from ros_scenesense.experiments.options import Options
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.experiments.tosd import Split, Tosd
from ros_scenesense.experiments.tosd_scenes import observed_scenes

SETS = 10
_QUICK_SETS = 3


def conduct(options: Options, say: Callable[[str], None]) -> Outcome:
    """Runs the experiment.

    Args:
        options: How; the dataset is a copy of the Table Object Scene Database.
        say: Takes a line when something has been done.

    Raises:
        DatasetError: If the database is not there or has too few labels.
    """
    count = _QUICK_SETS if options.quick else SETS
    if options.dataset is None:
        measured = _simulated(options, count, say)
    else:
        measured = _real(options, options.dataset, count, say)
    setting = Setting(options.command, options.seed, options.dataset is None)
    return report_on(measured, setting)


def _simulated(options: Options, count: int, say: Callable[[str], None]) -> list[Measured]:
    from joblib import Parallel, delayed, parallel_config

    plan = QUICK if options.quick else Plan()
    measured = []
    with parallel_config(backend="loky", inner_max_num_threads=1):
        jobs = Parallel(n_jobs=min(options.jobs, count), return_as="generator")
        sets = jobs(delayed(measure_simulated)(options.seed, n, plan) for n in range(count))
        for number, one in enumerate(sets, 1):
            measured.append(one)
            say(f"set {number} of {count}: combined {one.figures['combined']:.1f} %")
    return measured


def _real(options: Options, folder: Path, count: int, say: Callable[[str], None]) -> list[Measured]:
    tosd = Tosd(folder)
    taught, tested = (
        list(observed_scenes(tosd, split, options.seed)) for split in (Split.TRAINING, Split.TEST)
    )
    for split, scenes in ((Split.TRAINING, taught), (Split.TEST, tested)):
        pairs = sum(len(scene.truths) for scene in scenes)
        say(f"{split}: {len(scenes)} labelled scenes with {pairs} pairs")
    if len(taught) < count or not tested:
        raise DatasetError(
            f"'{folder}' has labels of {len(taught)} training and {len(tested)} test scenes, at "
            f"least {count} and 1 are needed: label more with `scenesense label {folder}`"
        )
    if not any(truth.distance for scene in taught for truth in scene.truths):
        raise DatasetError(
            f"'{tosd.label_file}' says of no training pair how near its objects are: the metric "
            "grounding names position and distance or nothing, so label distances too"
        )
    rng = np.random.default_rng(options.seed)
    parts: list[Sequence[ObservedScene]] = [
        [taught[int(index)] for index in part]
        for part in np.array_split(rng.permutation(len(taught)), count)
    ]
    measured = []
    for number, part in enumerate(parts):
        measured.append(
            measure_schemes(part, tested, np.random.default_rng([options.seed, number]))
        )
    return measured
