"""Experiment on learning axioms, hypothesis H4 of the paper: what examples teach is right.

Paper, experiment four. Ten disjoint sets of 50 labelled scenes, three seeds of the ensemble each;
the six axioms of the domain that are to be learned are missing. Added to the paper: its algorithm
beside ours, sets of 100 and 200, relations as grounding sees them, labels by the rules themselves.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ros_scenesense.attention.relevance import relevance
from ros_scenesense.errors import LearningError
from ros_scenesense.experiments.axioms_report import Run, Setting, report_on
from ros_scenesense.experiments.axioms_scenes import (
    ExactScenes,
    Scenes,
    domain,
    feedback_on,
    grounded_scenes,
    read_records,
    withheld_ids,
)
from ros_scenesense.experiments.options import Options, dataset_of
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.covering_learner import CoveringLearner
from ros_scenesense.learning.examples import Example
from ros_scenesense.learning.paper_learner import PaperLearner
from ros_scenesense.learning.scoring import Judge, Judged
from ros_scenesense.reasoning.program import FLUENTS

_RULED = 1_000_000
"""Tells the generator of exceptions from those of the sets."""

FEEDBACKS = 28
"""Pairs of each set of which a person says how they lie, as in the experiment on grounding."""


@dataclass(frozen=True)
class Plan:
    """How many sets of how many scenes, how often, and scenes that judge what was learned."""

    sets: int = 10
    scenes: int = 50
    pooled: tuple[int, ...] = (100, 200)
    repetitions: int = 3
    judging: int = 600

    @property
    def needed(self) -> int:
        """All scenes: those of the sets come first, then what is pooled with them."""
        return self.sets * max(self.scenes, *self.pooled) + self.judging


QUICK = Plan(sets=3, scenes=20, pooled=(30, 40), repetitions=1, judging=60)


@dataclass(frozen=True)
class _Sample:
    """Examples to learn from under one condition, and how sure their relations are."""

    condition: str
    examples: Mapping[str, Sequence[Example]]
    slack: float = 0.0


def conduct(options: Options, say: Callable[[str], None]) -> Outcome:
    """Runs the experiment.

    Args:
        options: How.
        say: Takes a line when something has been done.

    Raises:
        DatasetError: If the dataset is not there or has too few scenes.
    """
    plan = QUICK if options.quick else Plan()
    with tempfile.TemporaryDirectory() as state, dataset_of(options, plan.needed, say) as folder:
        records = read_records(folder, plan.needed)
        description = domain()
        exact = ExactScenes(description)
        whole = exact.read(records)
        ruled = exact.ruled(records, whole, np.random.default_rng([options.seed, _RULED]))
        say(f"{len(records)} scenes read")
        noisy, unseen = grounded_scenes(folder, plan.sets * plan.scenes, Path(state), say)
    runs: list[Run] = []
    slacks = []
    judges = {
        False: _judges(description, whole, plan),
        True: _judges(description, ruled, plan),
    }
    for number in range(plan.sets):
        own = _of_set(plan, number, plan.scenes)
        generator = np.random.default_rng([options.seed, number])
        feedback = feedback_on(
            [noisy["occluded"][i] for i in own], [records[i] for i in own], generator, FEEDBACKS
        )
        slacks.append(feedback.slack)
        samples = [
            _Sample(str(count), _examples(whole, _of_set(plan, number, count)))
            for count in (plan.scenes, *plan.pooled)
        ]
        samples.append(_Sample(f"noisy_{plan.scenes}", _examples(noisy, own), feedback.slack))
        samples.append(_Sample(f"control_{plan.scenes}", _examples(ruled, own)))
        for sample in samples:
            for repetition in range(plan.repetitions):
                seed = options.seed * 1000 + number * 10 + repetition
                judge = judges[sample.condition.startswith("control")]
                runs += _learn(description, sample, number, seed, judge)
        say(f"set {number + 1} of {plan.sets} learned from")
    setting = Setting(
        options.command, options.seed, plan.scenes, plan.pooled, plan.repetitions, plan.judging
    )
    return report_on(runs, setting, slacks, unseen / (plan.sets * plan.scenes))


def _learn(
    description: SystemDescription,
    sample: _Sample,
    number: int,
    seed: int,
    judges: Mapping[str, Judge],
) -> list[Run]:
    """What both learners make of a sample."""
    reduced = description.without(withheld_ids(description))
    judged: dict[str, list[Judged]] = {"covering": [], "paper": []}
    found: dict[str, list[str]] = {"covering": [], "paper": []}
    for fluent, task in FLUENTS.items():
        relations = relevance(reduced, task).relations
        learners: dict[str, CoveringLearner | PaperLearner] = {
            "covering": CoveringLearner(
                reduced, fluent, relations, slack=sample.slack, random_state=seed
            ),
            "paper": PaperLearner(reduced, fluent, relations, random_state=seed),
        }
        for way, learner in learners.items():
            try:
                learner.fit(sample.examples[fluent])
            except LearningError:
                # Too few examples, or of one label only: no axiom is learned.
                continue
            score = judges[fluent].score([each.axiom for each in learner.axioms_])
            judged[way] += score.judged
            found[way] += score.found
    return [
        Run(f"{way}_{sample.condition}", number, tuple(judged[way]), tuple(found[way]))
        for way in judged
    ]


def _judges(description: SystemDescription, scenes: Scenes, plan: Plan) -> dict[str, Judge]:
    """Judges by the last scenes, which nobody learns from."""
    return {
        fluent: Judge(
            description, fluent, [each for scene in several[-plan.judging :] for each in scene]
        )
        for fluent, several in scenes.items()
    }


def _of_set(plan: Plan, number: int, count: int) -> list[int]:
    """Scenes of a set; larger ones hold the smaller ones, and no two sets share any."""
    first = number * plan.scenes
    more = max(plan.pooled) - plan.scenes
    further = plan.sets * plan.scenes + number * more
    return [
        *range(first, first + min(count, plan.scenes)),
        *range(further, further + max(0, count - plan.scenes)),
    ]


def _examples(scenes: Scenes, numbers: Sequence[int]) -> dict[str, list[Example]]:
    return {
        fluent: [each for number in numbers for each in several[number]]
        for fluent, several in scenes.items()
    }
