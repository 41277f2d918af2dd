"""Learning axioms from few labelled scenes, and choosing between their versions; CPU time."""

from __future__ import annotations

from contextlib import closing

import numpy as np

from ros_scenesense.attention.relevance import relevance
from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.bench.timing import median_ms
from ros_scenesense.experiments.axioms_scenes import ExactScenes, Scenes, domain, withheld_ids
from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.learning.covering_learner import CoveringLearner
from ros_scenesense.learning.evaluation import holds
from ros_scenesense.learning.paper_learner import PaperLearner
from ros_scenesense.reasoning.program import FLUENTS
from ros_scenesense.reasoning.selection import Version, select
from ros_scenesense.results import Table
from ros_scenesense.scene import Task
from ros_scenesense.simulation.configuration import SimulationConfiguration
from ros_scenesense.simulation.dataset.record import record_of

_SCENES, _MERGING = 50, 10
_VERSIONS = 8

FIGURES = (
    Figure(
        "ensemble_ms",
        f"axioms about one fluent by 100 trees from {_SCENES} scenes, the slower fluent, median, "
        "ms CPU",
        at_most=200.0,
    ),
    Figure(
        "merge_ms",
        f"the best of {_VERSIONS} versions of six axioms each, by {_MERGING} scenes, median, "
        "ms CPU",
        at_most=30.0,
    ),
)


def measure(options: BenchOptions) -> Measured:
    """Times both on simulated scenes labelled by physics and visible pixels."""
    scenes = _scenes(_MERGING + 8 if options.quick else _SCENES + _MERGING, options.seed)
    repeats = 2 if options.quick else 9
    rows = [_learning(scenes, fluent, task, repeats) for fluent, task in FLUENTS.items()]
    groups, labels = _versions(scenes, np.random.default_rng(options.seed))
    figures = {
        "ensemble_ms": max(ours for _, _, ours, _ in rows),
        "merge_ms": median_ms(lambda: select(groups, [], labels), repeats),
    }
    columns = ["about", "examples", "ours ms", "Algorithm 1 ms"]
    table = Table(columns=columns, rows=[list(row) for row in rows])
    return Measured(figures, {"Learning, 100 trees": table})


def _learning(
    scenes: Scenes, fluent: str, task: Task, repeats: int
) -> tuple[str, int, float, float]:
    """Fluent, number of examples, and the times of both learners."""
    whole = domain()
    reduced = whole.without(withheld_ids(whole))
    relations = relevance(reduced, task).relations
    examples = [each for scene in scenes[fluent][:-_MERGING] for each in scene]
    ours = CoveringLearner(reduced, fluent, relations)
    paper = PaperLearner(reduced, fluent, relations)
    return (
        fluent,
        len(examples),
        median_ms(lambda: ours.fit(examples), repeats),
        median_ms(lambda: paper.fit(examples), repeats),
    )


def _scenes(count: int, seed: int) -> Scenes:
    from ros_scenesense.simulation.engine import SimulationEngine

    with closing(SimulationEngine(SimulationConfiguration(shadows=False))) as engine:
        records = [record_of(index, engine.scene(seed, index)) for index in range(count)]
    return ExactScenes(domain()).read(records)


def _versions(scenes: Scenes, rng: np.random.Generator) -> tuple[list[list[Version]], list[bool]]:
    """The six axioms that are to be learned, each with versions that say more, and the labels.

    A version that says more has more conditions, and holds of a random part of the objects.
    """
    examples = {
        fluent: [each for scene in several[-_MERGING:] for each in scene]
        for fluent, several in scenes.items()
    }
    labels = [each.label for several in examples.values() for each in several]
    groups = []
    for axiom in domain().axioms:
        if isinstance(axiom, StateConstraint | Default) and axiom.withheld:
            fluent = axiom.head.atom.name
            first = 0 if fluent == next(iter(examples)) else len(next(iter(examples.values())))
            fires = [
                number
                for number, each in enumerate(examples[fluent], first)
                if holds(axiom, each.state, each.target)
            ]
            groups.append(
                [
                    Version(
                        f"{axiom.id}_{more}",
                        axiom.head.positive,
                        axiom.kind == "normal",
                        len(axiom.body) + more,
                        frozenset(each for each in fires if rng.random() < _PART**more),
                    )
                    for more in range(_VERSIONS)
                ]
            )
    return groups, labels


# Of the objects that an axiom holds of, such a share remains with each condition more.
_PART = 0.8
