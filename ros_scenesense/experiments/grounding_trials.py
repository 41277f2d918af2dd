"""Trials of the experiment on grounding: teach a grounding, then ask it about pairs it never saw.

What is taught and asked goes through the functions that the nodes use: both models in
`stages.pair_grounding`, what is learned in `grounding.memory`, whom to believe in
`grounding.control`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from ros_scenesense.experiments.grounding_scenes import ObservedScene, Truth
from ros_scenesense.grounding.control import ARBITER, Control
from ros_scenesense.grounding.frames import camera_axes
from ros_scenesense.grounding.memory import Example, GroundingMemory
from ros_scenesense.grounding.msr import Source
from ros_scenesense.grounding.qsr import IMPROVED, PYRAMIDS
from ros_scenesense.grounding.viewpoint import ViewpointSettings
from ros_scenesense.messages.grounding import PairGrounding, Relation
from ros_scenesense.scene import Distance, Position
from ros_scenesense.stages.pair_grounding import GroundedPairs, ground_scene


@dataclass(frozen=True)
class Variant:
    """A qualitative model: in which axes, and by which rule."""

    name: str
    gravity: bool
    rule: str


DEFAULT = Variant("qsr_improved", True, IMPROVED)
PAPER = Variant("qsr_pyramids", False, PYRAMIDS)
VARIANTS = (
    PAPER,
    Variant("qsr_pyramids_gravity", True, PYRAMIDS),
    Variant("qsr_improved_camera", False, IMPROVED),
    DEFAULT,
)


class Asked:
    """A scene with its truth, and what is said of it.

    Args:
        scene: What was seen, and what is true.
        variant: The qualitative model.
    """

    def __init__(self, scene: ObservedScene, variant: Variant = DEFAULT) -> None:
        self.truths = scene.truths
        self._clouds = {f"{index:02d}": cloud for index, cloud in enumerate(scene.clouds)}
        self._axes = scene.axes if variant.gravity else camera_axes()
        self._rule = variant.rule

    @cached_property
    def untaught(self) -> GroundedPairs:
        """What the qualitative model says, and the histograms along the viewer's axes."""
        return self._ground(GroundingMemory())

    def pairs(self, memory: GroundingMemory | None) -> list[PairGrounding]:
        """What both models say; None asks the qualitative one alone."""
        if memory is None:
            return self.untaught.pairs
        if memory.yaw_rad != 0.0:
            return self._ground(memory).pairs
        said = memory.model.ground(self.untaught.histograms)
        return [
            PairGrounding(
                object=pair.object,
                reference=pair.reference,
                qsr=pair.qsr,
                msr=said.get((int(pair.object), int(pair.reference))),
            )
            for pair in self.untaught.pairs
        ]

    def example(self, truth: Truth, relation: Position | Distance, source: Source) -> Example:
        """The pair of a truth as an example of a relation."""
        seen = self.untaught.histograms
        forward, backward = (truth.first, truth.second), (truth.second, truth.first)
        return Example(relation, seen.pair(*forward), seen.pair(*backward), source)

    def _ground(self, memory: GroundingMemory) -> GroundedPairs:
        return ground_scene(self._clouds, self._axes, self._rule, memory)


@dataclass(frozen=True, eq=False)
class Question:
    """A pair of a scene."""

    asked: Asked
    truth: Truth


class Learner:
    """A grounding that is taught: both models, and who is to believe.

    Attributes:
        memory: What was learned.
        control: Whom to believe.
        speaks: The models that are asked; with both, control chooses.

    Args:
        mode: Of control.
        speaks: The models that are asked.
        keeps_axes: Never think that people's axes have turned.
    """

    def __init__(
        self,
        mode: str = ARBITER,
        speaks: tuple[Source, ...] = (Source.QSR, Source.MSR),
        keeps_axes: bool = False,
    ) -> None:
        self.memory = GroundingMemory(viewpoint=_KEEPS_AXES if keeps_axes else None)
        self.control = Control(mode)
        self.speaks = speaks

    def watch(self, questions: Iterable[Question]) -> None:
        """Takes what the qualitative model says of pairs as examples."""
        examples = []
        for one in questions:
            said = _said(one.asked.pairs(None), one.truth)[0].qsr
            if said is not None:
                for relation in (said.position, said.distance):
                    examples.append(one.asked.example(one.truth, relation, Source.QSR))
        self.memory.learn(examples)

    def hear(self, question: Question) -> None:
        """Takes what a person says of a pair: its position, and its distance if it is known."""
        said = question.asked.pairs(self.memory)
        forward, backward = _said(said, question.truth)
        for relation in (question.truth.position, question.truth.distance):
            if relation is not None:
                learned = self.control.learn(relation, forward, backward)
                example = question.asked.example(question.truth, relation, Source.HUMAN)
                self.memory.learn([example], learned.dropped)

    def answers(self, asked: Asked) -> dict[tuple[int, int], Relation]:
        """The relation of every pair (i, j), i < j, of a scene."""
        pairs = [
            PairGrounding(
                object=one.object,
                reference=one.reference,
                qsr=one.qsr if Source.QSR in self.speaks else None,
                msr=one.msr if Source.MSR in self.speaks else None,
            )
            for one in asked.pairs(self.memory if Source.MSR in self.speaks else None)
        ]
        relations = self.control.settle(pairs).relations
        found = {}
        for one in relations:
            key = sorted((int(one.object), int(one.reference)))
            found[key[0], key[1]] = one
        return found


_KEEPS_AXES = ViewpointSettings(change_share=1e-12, moved_share=1e-12)


@dataclass(frozen=True)
class Answer:
    """What was said of a pair beside what is true; None where nothing was said."""

    truth: Truth
    position: Position | None
    distance: Distance | None


def examine(learner: Learner, questions: Sequence[Question]) -> list[Answer]:
    """Asks about pairs; the learner learns nothing from it."""
    answers = []
    relations: dict[int, dict[tuple[int, int], Relation]] = {}
    for one in questions:
        scene = id(one.asked)
        if scene not in relations:
            relations[scene] = learner.answers(one.asked)
        truth = one.truth
        key = (min(truth.first, truth.second), max(truth.first, truth.second))
        said = relations[scene].get(key)
        if said is None:
            answers.append(Answer(truth, None, None))
            continue
        position: Position | None = said.position
        if int(said.object) != truth.first and position is not None:
            position = position.converse
        answers.append(Answer(truth, position, said.distance))
    return answers


def accuracy(answers: Iterable[Answer], clear: bool = False) -> float:
    """Share of the positions that are right, in percent; `clear`: of unambiguous pairs only.

    NaN where nobody named a position.
    """
    chosen = [
        one
        for one in answers
        if one.truth.position is not None and not (clear and one.truth.position_ambiguous)
    ]
    return _percent([one.position is one.truth.position for one in chosen])


def distance_accuracy(answers: Iterable[Answer]) -> float:
    """Share of the distances that are right, in percent; ambiguous ones are left out.

    NaN where nobody named a distance.
    """
    chosen = [
        one
        for one in answers
        if one.truth.distance is not None and not one.truth.distance_ambiguous
    ]
    return _percent([one.distance is one.truth.distance for one in chosen])


def _percent(right: Sequence[bool]) -> float:
    return 100.0 * float(np.mean(right)) if right else float("nan")


def questions_of(scenes: Iterable[Asked]) -> list[Question]:
    """All pairs of scenes."""
    return [Question(scene, truth) for scene in scenes for truth in scene.truths]


def one_of_each(
    questions: Sequence[Question], times: int, rng: np.random.Generator
) -> list[Question]:
    """So many pairs of each position relation, as a person may point them out; in random order.

    A pair to the left of another is also one to the right, named the other way round.
    """
    chosen: list[Question] = []
    taken: set[tuple[int, int, int]] = set()
    for relation in Position:
        fitting = [
            turned
            for one in questions
            for turned in (one, _turned(one))
            if turned is not None and turned.truth.position is relation
        ]
        found = 0
        for index in rng.permutation(len(fitting)):
            one = fitting[int(index)]
            pair = sorted((one.truth.first, one.truth.second))
            key = (id(one.asked), pair[0], pair[1])
            if key in taken:
                continue
            taken.add(key)
            chosen.append(one)
            found += 1
            if found == times:
                break
    return [chosen[int(index)] for index in rng.permutation(len(chosen))]


def spoilt(
    questions: Iterable[Question], share: float, rng: np.random.Generator
) -> Iterator[Question]:
    """The pairs with that share of them named wrongly, by any other relation."""
    for one in questions:
        if rng.random() >= share:
            yield one
            continue
        position, distance = one.truth.position, one.truth.distance
        if position is not None:
            position = _another(position, tuple(Position), rng)
        if distance is not None:
            distance = _another(distance, tuple(Distance), rng)
        yield Question(one.asked, replace(one.truth, position=position, distance=distance))


def _said(pairs: Iterable[PairGrounding], truth: Truth) -> tuple[PairGrounding, PairGrounding]:
    said = {(int(one.object), int(one.reference)): one for one in pairs}
    return said[truth.first, truth.second], said[truth.second, truth.first]


def _turned(question: Question) -> Question | None:
    """The same pair, the other way round; None if that has no name."""
    truth = question.truth
    position = None if truth.position is None else truth.position.converse
    if position is None:
        return None
    turned = replace(truth, first=truth.second, second=truth.first, position=position)
    return Question(question.asked, turned)


Word = TypeVar("Word", Position, Distance)


def _another(word: Word, choice: Sequence[Word], rng: np.random.Generator) -> Word:
    others = [one for one in choice if one is not word]
    return others[int(rng.integers(len(others)))]
