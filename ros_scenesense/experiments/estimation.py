"""Experiments on estimation, hypotheses H2 and H3 of the paper: networks need reasoning to look.

Paper, second and third set of experiments. Networks are trained on few and on many images, as the
paper does it with LeNet and AlexNet, on whole images or led by reasoning and attention; ours is the
network that is asked one question at a time. What is added to the paper: what reasoning alone
decides, the majority class, our network's inputs without reasoning, and without each part.
"""

from __future__ import annotations

import tempfile
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ros_scenesense.errors import DatasetError, ParameterError
from ros_scenesense.experiments.estimation_plans import (
    ESTIMATION,
    QUICK,
    SAMPLES,
    Plan,
)
from ros_scenesense.experiments.estimation_report import Setting, report_on
from ros_scenesense.experiments.estimation_samples import WAYS
from ros_scenesense.experiments.estimation_scenes import SEGMENTED, look_at
from ros_scenesense.experiments.estimation_trials import Trial, Tried, kept_trial, numbers_of
from ros_scenesense.experiments.options import Options, dataset_of
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.results import write_atomically

_PLANS = {"estimation": ESTIMATION, "samples": SAMPLES}
SCENES_PER_FILE = 100


@dataclass(frozen=True)
class EstimationOptions(Options):
    """How an experiment on estimation is run.

    Attributes:
        experiment: `estimation`, `samples` or `backgrounds`.
        scenes: How many scenes of the dataset to use, the first ones; 0 = all that the experiment
            asks for.
        network: `lenet`, `alexnet` or `query`: its ways alone; `all`.
        schedule: `validated`, or `paper`: the paper's iterations for its two networks.
        device: Where to train.
        ways: Only these of `estimation_samples.WAYS`; empty = all.
        sizes: Only these numbers of training images; empty = all.
        work: Folder that keeps the scenes as they were looked at, and finished trials, so that an
            interrupted run goes on; None = none.
    """

    experiment: str = "estimation"
    scenes: int = 0
    network: str = "all"
    schedule: str = "validated"
    device: str = "cpu"
    ways: tuple[str, ...] = ()
    sizes: tuple[int, ...] = ()
    work: Path | None = None


Say = Callable[[str], None]


def conduct(options: EstimationOptions, say: Say) -> Outcome:
    """Runs the experiment.

    Args:
        options: How.
        say: Takes a line when something has been done.

    Raises:
        DatasetError: If the dataset is none, or too small.
        ParameterError: If a way is none of those.
        NetworkError: If the scenes cannot teach anything.
    """
    check_ways(options.ways)
    plan = QUICK if options.quick else _PLANS[options.experiment]
    count = options.scenes or plan.scenes
    with tempfile.TemporaryDirectory() as folder, dataset_of(options, count, say) as dataset:
        views = options.work or Path(folder)
        scenes = look(dataset, views, plan, options, say)
        look_segmented(dataset, views, scenes, plan, options, say)
        tried = try_all(views, scenes, plan, options, say)
    setting = Setting(
        experiment=options.experiment,
        command=options.command,
        seed=options.seed,
        scenes=scenes,
        tests=plan.tests(scenes),
        repeats=plan.repeats,
        schedule=options.schedule,
    )
    return report_on(tried, setting)


def check_ways(ways: Iterable[str]) -> None:
    """Says which ways there are.

    Raises:
        ParameterError: If one is none of them.
    """
    unknown = set(ways) - WAYS.keys()
    if unknown:
        raise ParameterError(
            f"--ways names {', '.join(sorted(unknown))}, must be of {', '.join(WAYS)}"
        )


def look(dataset: Path, folder: Path, plan: Plan, options: EstimationOptions, say: Say) -> int:
    """Shows scenes to the loop and keeps what networks need; gives how many.

    Raises:
        DatasetError: If there are too few, or the folder keeps others.
    """
    whose, numbers = wanted(dataset, plan, options)
    claim(folder, whose)
    tasks = []
    for start in range(0, len(numbers), SCENES_PER_FILE):
        file = folder / f"{start:06d}.joblib"
        if not file.exists():
            part = numbers[start : start + SCENES_PER_FILE]
            tasks.append(partial(look_at, dataset, part, options.seed, file))
    look_in_parts(tasks, len(numbers), options.jobs, say)
    return len(numbers)


def wanted(dataset: Path, plan: Plan, options: EstimationOptions) -> tuple[str, range]:
    """Which scenes of a dataset are to be used, in words and by their numbers.

    Raises:
        DatasetError: If there are too few.
    """
    from ros_scenesense.simulation.dataset.reader import DatasetReader

    reader = DatasetReader(dataset)
    count = min(len(reader), options.scenes or plan.most_scenes)
    smallest = min(min(sizes) for sizes in plan.sizes.values())
    if count - plan.tests(count) < smallest:
        raise DatasetError(
            f"{count} scenes are too few to train on {smallest} and test on a third: generate more"
        )
    return f"{reader.metadata.fingerprint()} seed {options.seed}, {count} scenes\n", range(count)


def look_segmented(
    dataset: Path, folder: Path, scenes: int, plan: Plan, options: EstimationOptions, say: Say
) -> None:
    """Shows scenes to the loop once more, as segmentation sees them, where a way is to use that."""
    parts: dict[int, list[int]] = defaultdict(list)
    for number in sorted(
        {
            number
            for trial in trials_of(scenes, plan, options)
            if trial.way in WAYS and WAYS[trial.way].segments
            for part in numbers_of(trial, scenes)
            for number in part
        }
    ):
        parts[number // SCENES_PER_FILE].append(number)
    tasks = []
    for start, part in parts.items():
        # Not all scenes are segmented, and another run may need others.
        end = f"{zlib.crc32(repr(part).encode()):08x}"
        file = folder / SEGMENTED / f"{start * SCENES_PER_FILE:06d}-{end}.joblib"
        if not file.exists():
            file.parent.mkdir(exist_ok=True)
            tasks.append(partial(look_at, dataset, part, options.seed, file, segments=True))
    look_in_parts(tasks, sum(map(len, parts.values())), options.jobs, say, "looked as segmented at")


def look_in_parts(
    tasks: Sequence[Callable[[], int]],
    scenes: int,
    jobs: int,
    say: Say,
    words: str = "looked at",
) -> None:
    """Looks at scenes in worker processes.

    Args:
        tasks: What is still to be done; each gives how many scenes it looked at.
        scenes: How many there are, those of earlier runs among them.
        jobs: Worker processes.
        say: Takes a line every 500 scenes.
        words: What is done.
    """
    from joblib import Parallel, delayed, parallel_config

    if not tasks:
        return
    done = 0
    with parallel_config(backend="loky", inner_max_num_threads=1):
        working = Parallel(n_jobs=min(jobs, len(tasks)), return_as="generator")
        for number in working(delayed(task)() for task in tasks):
            before, done = done, done + number
            if before // 500 < done // 500:
                say(f"{words} {done} more of {scenes} scenes")
    say(f"{words} all {scenes} scenes")


def trials_of(scenes: int, plan: Plan, options: EstimationOptions) -> list[Trial]:
    """The trials that are wanted, of a plan with so many scenes."""
    return [
        trial
        for trial in plan.trials(scenes, options.seed, options.schedule, options.device)
        if trial.way not in WAYS
        or (
            options.network in ("all", WAYS[trial.way].kind)
            and (not options.ways or trial.way in options.ways)
            and (not options.sizes or trial.images in options.sizes)
        )
    ]


def try_all(
    folder: Path, scenes: int, plan: Plan, options: EstimationOptions, say: Say
) -> list[Tried]:
    """Runs all trials of a plan on scenes that were looked at."""
    from joblib import Parallel, delayed, parallel_config

    trials = trials_of(scenes, plan, options)
    tried = []
    with parallel_config(backend="loky", inner_max_num_threads=1):
        jobs = Parallel(
            n_jobs=min(options.jobs, len(trials)),
            return_as="generator_unordered",
            pre_dispatch="n_jobs",
            batch_size=1,
        )
        for one in jobs(delayed(kept_trial)(folder, trial) for trial in trials):
            tried.append(one)
            trial, scores = one.trial, next(iter(one.scores.values()))
            say(
                f"trial {len(tried)} of {len(trials)}: {trial.way}, {trial.images} images, "
                f"{trial.knowledge} knowledge: {scores['accuracy']:.1%}, {one.seconds:.0f} s"
            )
    # In the order of the plan, whoever was first.
    place = {trial: number for number, trial in enumerate(trials)}
    return sorted(tried, key=lambda one: place[one.trial])


def claim(folder: Path, whose: str) -> None:
    """Takes a folder for some scenes, or finds it taken for them."""
    mark = folder / "scenes.txt"
    if not mark.exists():
        if folder.exists() and any(folder.iterdir()):
            raise DatasetError(f"'{folder}' holds something else: choose a new folder")
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(mark, whose.encode())
    elif mark.read_text() != whose:
        raise DatasetError(
            f"'{folder}' keeps other scenes, {mark.read_text().strip()}: choose a new folder"
        )
