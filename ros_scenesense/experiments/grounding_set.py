"""One of the sets of the experiment on grounding: everything that is measured on it.

Paper, section *Incremental Grounding*: per set, seven pairs with human feedback, one for each
position relation, and 200 pairs labelled by the qualitative model teach; 200 other pairs test.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ros_scenesense.experiments.grounding_scenes import ObservedScene, SceneMaker
from ros_scenesense.experiments.grounding_trials import (
    DEFAULT,
    PAPER,
    VARIANTS,
    Answer,
    Asked,
    Learner,
    Question,
    Variant,
    accuracy,
    distance_accuracy,
    examine,
    one_of_each,
    questions_of,
    spoilt,
)
from ros_scenesense.experiments.segmentation_share import segmentation_shares
from ros_scenesense.grounding.control import SWITCH
from ros_scenesense.grounding.msr import Source

QSR_PAIRS = 200
TEST_PAIRS = 200
WRONG_SHARES = (0.0, 0.1, 0.2, 0.3, 0.4)
YAWS_DEG = (20, 40, 90)
TIMES = {7: 1, 28: 4}
"""Feedback pairs, and how many of each relation these are."""


@dataclass(frozen=True)
class Plan:
    """How large a set is.

    Attributes:
        taught: Scenes that teach, before any change of the viewpoint.
        tested: Scenes that test.
        turned_taught: Scenes of feedback after a change of the viewpoint.
        turned_tested: Scenes that test after it.
        segmented: Frames without instance ids, of which the objects must be found.
        yaws_deg: Changes of the viewpoint.
    """

    taught: int = 26
    tested: int = 26
    turned_taught: int = 12
    turned_tested: int = 10
    segmented: int = 6
    yaws_deg: tuple[int, ...] = YAWS_DEG


QUICK = Plan(taught=14, tested=6, turned_taught=8, turned_tested=4, segmented=1, yaws_deg=(40,))


@dataclass
class Measured:
    """What was found on a set.

    Attributes:
        figures: By name: accuracies in percent, and shares of segmented objects.
        confusions: By name of a way, how often what is true (first) was called what (second).
    """

    figures: dict[str, float] = field(default_factory=dict)
    confusions: dict[str, Counter[tuple[str, str]]] = field(default_factory=dict)


def measure_simulated(seed: int, number: int, plan: Plan) -> Measured:
    """Simulates the scenes of a set and measures everything on them.

    Args:
        seed: Of the experiment; sets of other numbers have other scenes.
        number: Of the set.
        plan: How large it is.
    """
    maker = SceneMaker()

    def scenes(purpose: int, count: int, turned_deg: int = 0, step: int = 1) -> list[ObservedScene]:
        series = _series(seed, number, purpose, turned_deg)
        turned_rad = math.radians(turned_deg)
        return [maker.scene(series, index * step, turned_rad) for index in range(count)]

    taught, tested = scenes(0, plan.taught), scenes(1, plan.tested)
    rng = np.random.default_rng([seed, number])
    measured = measure_schemes(taught, tested, rng)
    asked = _asked(taught)
    questions = _some(questions_of(_asked(tested)), TEST_PAIRS, rng)
    _measure_errors(measured, questions_of(asked), questions, rng)
    for yaw_deg in plan.yaws_deg:
        # Only scenes of even numbers show every relation.
        feedback = scenes(2, plan.turned_taught, yaw_deg, step=2)
        turned = questions_of(_asked(scenes(3, plan.turned_tested, yaw_deg)))
        words = questions_of(_asked(feedback))
        _measure_turn(measured, yaw_deg, questions_of(asked), words, turned, rng)
    maker.close()
    measured.figures |= segmentation_shares(_series(seed, number, 4), plan.segmented)
    return measured


def _series(seed: int, number: int, purpose: int, turned_deg: int = 0) -> int:
    """Seed of a series of scenes."""
    return int(np.random.default_rng([seed, number, purpose, turned_deg]).integers(2**53))


def measure_schemes(
    taught: Sequence[ObservedScene], tested: Sequence[ObservedScene], rng: np.random.Generator
) -> Measured:
    """The paper's three schemes, the qualitative models alone, and the paper's method as a whole.

    Args:
        taught: Scenes with the pairs that teach.
        tested: Scenes with the pairs that test.
        rng: Chooses the pairs.
    """
    measured = Measured()
    state = int(rng.integers(2**53))
    for variant in VARIANTS:
        # The same pairs for every variant.
        choice = np.random.default_rng(state)
        learning, testing = (questions_of(_asked(scenes, variant)) for scenes in (taught, tested))
        questions = _some(testing, TEST_PAIRS, choice)
        alone = examine(Learner(speaks=(Source.QSR,)), questions)
        _note(measured, variant.name, alone)
        if variant in (DEFAULT, PAPER):
            suffix = "" if variant is DEFAULT else "_paper_method"
            _measure_learning(measured, suffix, learning, questions, choice)
    measured.figures["distance_qsr"] = measured.figures[f"distance_{DEFAULT.name}"]
    return measured


def _measure_learning(
    measured: Measured,
    suffix: str,
    learning: Sequence[Question],
    questions: Sequence[Question],
    rng: np.random.Generator,
) -> None:
    seven = one_of_each(learning, TIMES[7], rng)
    few = Learner(speaks=(Source.MSR,))
    _tell(few, seven)
    _note(measured, f"msr_feedback{suffix}", examine(few, questions))
    for name, mode in (("combined", None), ("combined_switch", SWITCH)):
        learner = Learner() if mode is None else Learner(mode)
        learner.watch(_some(learning, QSR_PAIRS, np.random.default_rng(0)))
        _tell(learner, seven)
        _note(measured, name + suffix, examine(learner, questions))
        if mode is None:
            learner.speaks = (Source.MSR,)
            _note(measured, f"msr_qsr_feedback{suffix}", examine(learner, questions))


def _measure_errors(
    measured: Measured,
    learning: Sequence[Question],
    questions: Sequence[Question],
    rng: np.random.Generator,
) -> None:
    """Combined accuracy after 28 feedbacks of which a share is wrong."""
    words = one_of_each(learning, TIMES[28], rng)
    for share in WRONG_SHARES:
        learner = Learner()
        learner.watch(_some(learning, QSR_PAIRS, np.random.default_rng(0)))
        _tell(learner, spoilt(words, share, np.random.default_rng(int(rng.integers(2**53)))))
        name = f"wrong{round(100 * share)}"
        measured.figures[f"combined_{name}"] = accuracy(examine(learner, questions))
        learner.speaks = (Source.MSR,)
        measured.figures[f"msr_{name}"] = accuracy(examine(learner, questions))


def _measure_turn(
    measured: Measured,
    yaw_deg: int,
    learning: Sequence[Question],
    words: Sequence[Question],
    questions: Sequence[Question],
    rng: np.random.Generator,
) -> None:
    """Accuracy after the camera went round the table while people's words stayed the same."""
    name = f"yaw{yaw_deg}_"
    alone = examine(Learner(speaks=(Source.QSR,)), questions)
    measured.figures[f"{name}qsr_improved"] = accuracy(alone)
    seven = one_of_each(learning, TIMES[7], rng)
    new = {0: [], **{count: one_of_each(words, times, rng) for count, times in TIMES.items()}}
    for count, spoken in new.items():
        for suffix, known, keeps_axes in (
            ("", True, False),
            ("_unannounced", False, False),
            ("_learning_alone", False, True),
        ):
            learner = Learner(keeps_axes=keeps_axes)
            learner.watch(_some(learning, QSR_PAIRS, np.random.default_rng(0)))
            _tell(learner, seven)
            if known:
                learner.memory.expect_change()
            _tell(learner, spoken)
            measured.figures[f"{name}feedback{count}{suffix}"] = accuracy(
                examine(learner, questions)
            )


def _tell(learner: Learner, words: Iterable[Question]) -> None:
    for one in words:
        learner.hear(one)


def _note(measured: Measured, name: str, answers: Sequence[Answer]) -> None:
    measured.figures[name] = accuracy(answers)
    measured.figures[f"{name}_unambiguous"] = accuracy(answers, clear=True)
    measured.figures[f"distance_{name}"] = distance_accuracy(answers)
    measured.confusions[name] = Counter(
        (str(one.truth.position), str(one.position))
        for one in answers
        if one.truth.position is not None
    )


def _asked(scenes: Iterable[ObservedScene], variant: Variant = DEFAULT) -> list[Asked]:
    return [Asked(scene, variant) for scene in scenes]


def _some(questions: Sequence[Question], count: int, rng: np.random.Generator) -> list[Question]:
    order = rng.permutation(len(questions))[:count]
    return [questions[int(index)] for index in order]
