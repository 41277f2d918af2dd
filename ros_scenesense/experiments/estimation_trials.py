"""Trials of the experiments on estimation: train a network on some scenes, score it on others.

Who is asked decides as on the graph: reasoning first, then the network, by `attention.estimator`.
The baselines see whole images and no reasoning takes part.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ros_scenesense.attention.estimator import Estimator, measured_purity
from ros_scenesense.experiments.estimation_samples import (
    COLUMN,
    NO_NUMBERS,
    SLOTS,
    WAYS,
    Float,
    Way,
    answered,
    pixels,
    samples_of,
    shown,
    structures_of,
)
from ros_scenesense.experiments.estimation_scenes import ALEXNET_SIDE, SEGMENTED, views_in
from ros_scenesense.experiments.estimation_scores import Decisions, Scores, majority_of, score
from ros_scenesense.experiments.estimation_views import Literal, Reasoned, View
from ros_scenesense.scene import DecisionStatus, Task, structure_truth
from ros_scenesense.stages.attention import SIDE

if TYPE_CHECKING:
    from ros_scenesense.attention.networks.answers import TrainedNetwork
    from ros_scenesense.attention.networks.kinds import NetworkConfiguration
    from ros_scenesense.attention.networks.samples import Samples
    from ros_scenesense.attention.networks.training import TrainingConfiguration

ITERATIONS = 1500
"""Batches at most."""
_PATIENCE = 8
"""Of LeNet and AlexNet, whose batches take long."""
_ALEXNET_WIDTH = 0.125
_ALEXNET_RATE = 5e-4


@dataclass(frozen=True)
class Trial:
    """One training and its test.

    Attributes:
        way: One of `WAYS`, or `reasoning`, which trains nothing.
        knowledge: One of `estimation_scenes.KNOWLEDGE`; bears on ways that attend.
        images: Scenes to train on, a fifth of which only says when to stop.
        seed: Of their choice, of weights and batches.
        tests: How many scenes, the last ones, are tested on.
        schedule: `validated`, or `paper`: its iterations.
        device: Where to train.
        shortened: Few iterations, to see that it runs.
    """

    way: str
    knowledge: str
    images: int
    seed: int
    tests: int
    schedule: str = "validated"
    device: str = "cpu"
    shortened: bool = False


@dataclass(frozen=True)
class Tried:
    """What came of a trial.

    Attributes:
        trial: Which one.
        scores: By the name of the way; a query network is scored in both modes of the estimator.
        examples: What the network was trained and validated on.
        iterations: Batches until the best weights; 0 where nothing was trained.
        seconds: CPU time of the training.
    """

    trial: Trial
    scores: dict[str, Scores]
    examples: int = 0
    iterations: int = 0
    seconds: float = 0.0


def run_trial(folder: Path, trial: Trial) -> Tried:
    """Trains and tests.

    Args:
        folder: Of the scenes that were looked at.
        trial: What to do.

    Raises:
        NetworkError: If the scenes cannot teach anything.
    """
    views = views_in(folder)
    taught_numbers, tested_numbers = numbers_of(trial, len(views))
    if trial.way in WAYS and WAYS[trial.way].segments:
        views = views_in(folder / SEGMENTED)
    taught = [views[each] for each in taught_numbers]
    tested = [views[each] for each in tested_numbers]
    if trial.way not in WAYS:
        return Tried(trial, _untrained(taught, tested, trial.knowledge))
    way = WAYS[trial.way]
    samples = samples_of(way, taught, trial.knowledge)
    start = time.process_time()
    trained = _train(way, samples, trial)
    seconds = time.process_time() - start
    scores = {
        name: score(zip(tested, decided, strict=True))
        for name, decided in _decided(trial, trained, taught, tested).items()
    }
    return Tried(trial, scores, len(samples), trained.iterations, seconds)


def numbers_of(trial: Trial, scenes: int) -> tuple[list[int], list[int]]:
    """The scenes that a trial trains on and tests, of so many."""
    last = scenes - trial.tests
    rng = np.random.default_rng([trial.seed, trial.images])
    return rng.permutation(last)[: trial.images].tolist(), list(range(last, scenes))


def kept_trial(folder: Path, trial: Trial) -> Tried:
    """A trial that is kept beside the scenes: done if it is not there yet."""
    import joblib

    parts = (trial.way, trial.knowledge, trial.images, trial.seed, trial.tests, trial.schedule)
    end = "-shortened" if trial.shortened else ""
    file = folder / "trials" / f"{'-'.join(map(str, parts))}{end}.joblib"
    if not file.exists():
        file.parent.mkdir(exist_ok=True)
        partial = file.with_suffix(".partial")
        joblib.dump(run_trial(folder, trial), partial)
        partial.replace(file)
    tried: Tried = joblib.load(file)
    return tried


# --- Without a network.


def _untrained(taught: Sequence[View], tested: Sequence[View], knowledge: str) -> dict[str, Scores]:
    """Reasoning alone, with the most frequent answer where it is undecided, and that alone."""
    usual = majority_of(taught)
    reasoning = [_by_reasoning(view, view.reasoned[knowledge]) for view in tested]
    answers: dict[str, list[Decisions]] = {
        "reasoning": reasoning,
        "reasoning_majority": [
            {
                key: usual[_subject(key)] if value is None else value
                for key, value in decisions.items()
            }
            for decisions in reasoning
        ],
        "majority": [{key: usual[_subject(key)] for key in decisions} for decisions in reasoning],
    }
    return {name: score(zip(tested, decided, strict=True)) for name, decided in answers.items()}


def _subject(key: Literal | tuple[str, ...]) -> str:
    last = key[-1]
    return str(last) if isinstance(last, Task) else ("stack" if len(key) > 1 else "structure")


def _by_reasoning(view: View, reasoned: Reasoned) -> Decisions:
    return _with_structures(
        view, {literal: belief.value for literal, belief in reasoned.beliefs.items()}
    )


def _with_structures(view: View, literals: Mapping[Literal, bool | None]) -> Decisions:
    """Decisions about objects, none about those that were not found, and about structures."""
    literals = dict.fromkeys(view.labels) | dict(literals)
    stable = {name: value for (name, task), value in literals.items() if task is Task.STABILITY}
    decisions: Decisions = dict(literals.items())
    decisions.update({each: structure_truth(each, stable) for each, _ in view.structures})
    return decisions


# --- Training.


def _train(way: Way, samples: Samples, trial: Trial) -> TrainedNetwork:
    from ros_scenesense.attention.networks.training import train

    return train(_network(way), samples, _schedule(way, trial), device=trial.device)


def _network(way: Way) -> NetworkConfiguration:
    from ros_scenesense.attention.networks.alexnet import AlexNetConfiguration
    from ros_scenesense.attention.networks.lenet import LeNetConfiguration
    from ros_scenesense.attention.networks.query import QueryNetworkConfiguration

    if way.kind == "query":
        return QueryNetworkConfiguration(side=SIDE)
    if way.kind == "lenet":
        return LeNetConfiguration(structures=SLOTS, objects=SLOTS)
    return AlexNetConfiguration(
        side=ALEXNET_SIDE,
        width=_ALEXNET_WIDTH,
        structures=SLOTS,
        objects=SLOTS,
        learning_rate=_ALEXNET_RATE,
    )


def _schedule(way: Way, trial: Trial) -> TrainingConfiguration:
    from ros_scenesense.attention.networks.training import (
        TrainingConfiguration,
        paper_iterations,
        query_training,
    )

    if trial.shortened:
        return TrainingConfiguration(iterations=20, interval=10, seed=trial.seed)
    if way.kind == "query":
        return query_training(ITERATIONS, trial.seed)
    if trial.schedule == "paper":
        return TrainingConfiguration(
            iterations=paper_iterations(way.kind, trial.images),
            validation_share=0.0,
            interval=1000,
            patience=0,
            seed=trial.seed,
        )
    return TrainingConfiguration(iterations=ITERATIONS, patience=_PATIENCE, seed=trial.seed)


# --- What is decided.


def _decided(
    trial: Trial, trained: TrainedNetwork, taught: Sequence[View], tested: Sequence[View]
) -> dict[str, list[Decisions]]:
    way = WAYS[trial.way]
    if way.kind == "query" and way.attends:
        return _by_estimator(trial, trained, taught, tested)
    if way.kind == "query":
        asked = [[shown(way, each) for each in view.whole] for view in tested]
        return {
            trial.way: [
                _with_structures(
                    view,
                    {
                        (question.target, task): bool(row[COLUMN[task]] >= 0.5)
                        for question, row in zip(view.whole, rows, strict=True)
                        for task in Task
                    },
                )
                for view, rows in zip(tested, answered(trained, asked), strict=True)
            ]
        }
    if way.attends:
        return {trial.way: _by_regions(way, trained, tested, trial.knowledge)}
    whole = [[(pixels(way, view, None), NO_NUMBERS)] for view in tested]
    return {
        trial.way: [
            _slots(view, view.objects, rows[0])
            for view, rows in zip(tested, answered(trained, whole), strict=True)
        ]
    }


def _by_estimator(
    trial: Trial, trained: TrainedNetwork, taught: Sequence[View], tested: Sequence[View]
) -> dict[str, list[Decisions]]:
    """In both modes; only one that may overrule asks the network about defaults."""
    way, knowledge = WAYS[trial.way], trial.knowledge
    reasoned = [view.reasoned[knowledge] for view in tested]
    asked = [[*each.undecided.questions, *each.defaults] for each in reasoned]
    inputs = [[shown(way, each) for each in questions] for questions in asked]
    purity = measured_purity(_conclusions(taught, knowledge))
    estimators = {
        trial.way: Estimator(),
        f"{trial.way}_overrule": Estimator("overrule", purity=purity),
    }
    decided: dict[str, list[Decisions]] = {name: [] for name in estimators}
    for view, one, questions, rows in zip(
        tested, reasoned, asked, answered(trained, inputs), strict=True
    ):
        said = {
            (question.target, question.task): float(row[COLUMN[question.task]])
            for question, row in zip(questions, rows, strict=True)
        }
        for name, estimator in estimators.items():
            literals = {
                literal: estimator.decide(belief, said.get(literal)).value
                for literal, belief in one.beliefs.items()
            }
            decided[name].append(_with_structures(view, literals))
    return decided


def _conclusions(views: Sequence[View], knowledge: str) -> dict[str, tuple[int, int]]:
    """How often each default was right and wrong."""
    counts: dict[str, tuple[int, int]] = {}
    for view in views:
        for literal, belief in view.reasoned[knowledge].beliefs.items():
            label = view.labels.get(literal)
            if belief.status is not DecisionStatus.BY_DEFAULT or label is None:
                continue
            for axiom in belief.axioms:
                right, wrong = counts.get(axiom, (0, 0))
                correct = belief.value is label
                counts[axiom] = (right + correct, wrong + (not correct))
    return counts


def _by_regions(
    way: Way, trained: TrainedNetwork, tested: Sequence[View], knowledge: str
) -> list[Decisions]:
    """Reasoning, and for what it leaves open the slots of the region that was cut out for it."""
    reasoned = [view.reasoned[knowledge] for view in tested]
    inputs = [
        [(pixels(way, view, region), NO_NUMBERS) for region in one.undecided.regions]
        for view, one in zip(tested, reasoned, strict=True)
    ]
    found = []
    for view, one, rows in zip(tested, reasoned, answered(trained, inputs), strict=True):
        decisions = _by_reasoning(view, one)
        for region, row in zip(one.undecided.regions, rows, strict=True):
            slots = _slots(view, region.objects, row)
            for key, value in slots.items():
                last = key[-1]
                task = last if isinstance(last, Task) else Task.STABILITY
                in_question = not set(key).isdisjoint(region.targets)
                if task is region.task and in_question and decisions[key] is None:
                    decisions[key] = value
        # Slots are of structures: this way says nothing about the stability of single objects.
        found.append({key: each for key, each in decisions.items() if key[-1] != Task.STABILITY})
    return found


def _slots(view: View, objects: Sequence[str], row: Float) -> Decisions:
    decisions: Decisions = {
        members: bool(row[slot] >= 0.5) for slot, members in enumerate(structures_of(view, objects))
    }
    for slot, name in enumerate(objects):
        decisions[name, Task.OCCLUSION] = bool(row[SLOTS + slot] >= 0.5)
    return decisions
