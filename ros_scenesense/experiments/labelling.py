"""Asks a person for the relations of pairs of objects in real scenes, one pair after the other.

Every answer is on disk before the next question, so a session may end at any point and goes on
there when it is started again.
"""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from ros_scenesense.demo.annotation import Image, Note, annotate, write_picture
from ros_scenesense.experiments.relation_labels import (
    UNCLEAR,
    RelationLabel,
    read_labels,
    write_labels,
)
from ros_scenesense.experiments.tosd import Split, Tosd, TosdScene, instances_in
from ros_scenesense.scene import Distance, Position

CONTAINS = "contains"
"""An answer: the reference is in the object. It is kept as `in`, with the two exchanged."""

POSITIONS = {
    "l": Position.LEFT,
    "r": Position.RIGHT,
    "f": Position.FRONT,
    "h": Position.BEHIND,
    "a": Position.ABOVE,
    "b": Position.BELOW,
    "i": Position.IN,
    "c": CONTAINS,
    "?": UNCLEAR,
}
DISTANCES = {"t": Distance.TOUCHING, "n": Distance.NOT_TOUCHING, "d": Distance.FAR}
HELP = """\
How does the first object lie to the second, seen by the camera? In front is nearer to you.
  l left   r right   f front   h behind   a above   b below   i in   c contains   ? unclear
And how near are they?    t touching   n not touching   d far (distant)
For example `l n` or `a t`. Also: u undo the last answer, q quit, Enter shows this again."""
HOW_NEAR = "  touching, not touching or far? (t, n, d; Enter if you cannot say) "
_COLORS = [
    (200, 30, 30),
    (20, 110, 200),
    (0, 130, 60),
    (150, 60, 170),
    (190, 110, 0),
    (0, 130, 140),
]


@dataclass(frozen=True)
class Question:
    """A pair of a scene that a person is asked about."""

    scene: str
    object: str
    reference: str

    @property
    def pair(self) -> frozenset[str]:
        """The two objects, whichever is the reference."""
        return frozenset((self.object, self.reference))


@dataclass(frozen=True)
class LabellingOptions:
    """What is asked.

    Attributes:
        pairs: At most so many pairs of a scene, drawn at random, the same ones each time.
        split: Only this set; None = both.
        pictures: Folder that the pictures of the scenes go to.
    """

    pairs: int
    split: Split | None
    pictures: Path


class Labelling:
    """A session of questions.

    Args:
        tosd: The scenes.
        options: What is asked.
        ask: Shows a question, returns the answer; raises EOFError when there will be none.
        tell: Shows a line.

    Raises:
        DatasetError: If the label file is wrong.
    """

    def __init__(
        self,
        tosd: Tosd,
        options: LabellingOptions,
        ask: Callable[[str], str],
        tell: Callable[[str], None],
    ) -> None:
        self._tosd = tosd
        self._options = options
        self._ask = ask
        self._tell = tell
        self._labels = read_labels(tosd.label_file)
        self._answered: list[Question] = []

    def run(self) -> int:
        """Asks until everything is answered or the person quits; the number of pairs answered.

        Raises:
            DatasetError: If a scene is damaged or the labels cannot be written.
        """
        names = self._tosd.names(self._options.split)
        self._tell(HELP)
        try:
            for number, name in enumerate(names, start=1):
                self._scene(name, f"{name} ({number} of {len(names)})")
        except EOFError:
            pass
        return len(self._answered)

    def _scene(self, name: str, title: str) -> None:
        scene = self._tosd.load(name)
        open_questions = [one for one in self._questions(scene) if not self._has(one)]
        if not open_questions:
            return
        picture = self._options.pictures / f"{name}.png"
        write_picture(draw_objects(scene), picture)
        self._tell(f"\n{title}: look at {picture}")
        while open_questions:
            question = open_questions[0]
            answer = self._answer(f"{question.object} is ... of/to {question.reference}: ")
            if answer is not None:
                self._keep(question, *answer)
                open_questions.pop(0)
            elif self._answered:
                undone = self._undo()
                if undone.scene == name:
                    open_questions.insert(0, undone)
                else:
                    self._tell(f"scene {undone.scene} will be asked about in the next session")
            else:
                self._tell("nothing to undo in this session")

    def _questions(self, scene: TosdScene) -> Iterator[Question]:
        pairs = list(itertools.combinations(scene.objects, 2))
        if len(pairs) > self._options.pairs:
            # By the name of the scene: the same pairs in every session, on every machine.
            rng = np.random.default_rng(zlib.crc32(scene.name.encode()))
            chosen = rng.choice(len(pairs), self._options.pairs, replace=False)
            pairs = [pairs[index] for index in sorted(chosen)]
        return (Question(scene.name, *pair) for pair in pairs)

    def _has(self, question: Question) -> bool:
        return any(
            label.scene == question.scene and label.pair == question.pair for label in self._labels
        )

    def _answer(self, words: str) -> tuple[str, str | None] | None:
        """The position word and perhaps a distance; None if the last answer is to be undone.

        Raises:
            EOFError: If the person quits.
        """
        while True:
            given = self._ask(words).strip().lower().split()
            if given in (["q"], ["quit"]):
                raise EOFError
            if given in (["u"], ["undo"]):
                return None
            position = _choice(given[:1], POSITIONS)
            distance = _choice(given[1:2], DISTANCES)
            if position == UNCLEAR and len(given) == 1:
                return position, None
            if position is not None and len(given) == 1:
                return position, self._distance()
            if position not in (None, UNCLEAR) and distance is not None and len(given) == 2:
                return position, distance
            self._tell(HELP if not given else f"'{' '.join(given)}' is no answer.\n{HELP}")

    def _distance(self) -> str | None:
        """How near they are; None if the person cannot say.

        Raises:
            EOFError: If the person quits.
        """
        while True:
            given = self._ask(HOW_NEAR).strip().lower().split()
            if given in (["q"], ["quit"]):
                raise EOFError
            distance = _choice(given, DISTANCES)
            if not given or (distance is not None and len(given) == 1):
                return distance

    def _keep(self, question: Question, position: str, distance: str | None) -> None:
        one, other = question.object, question.reference
        if position == CONTAINS:
            one, other, position = other, one, Position.IN
        for relation in (position, distance):
            if relation is not None:
                words = {"scene": question.scene, "object": one, "reference": other}
                self._labels.append(msgspec.convert(words | {"relation": relation}, RelationLabel))
        self._answered.append(question)
        write_labels(self._tosd.label_file, self._labels)

    def _undo(self) -> Question:
        question = self._answered.pop()
        self._labels = [
            label
            for label in self._labels
            if label.scene != question.scene or label.pair != question.pair
        ]
        write_labels(self._tosd.label_file, self._labels)
        return question


def draw_objects(scene: TosdScene) -> Image:
    """The scene with outline and name of every annotated object; RGB."""
    frame = scene.frame
    assert frame.instances is not None
    notes = [
        Note(instance, f"object_{instance}", _COLORS[index % len(_COLORS)])
        for index, instance in enumerate(instances_in(frame))
    ]
    return annotate(frame.color, frame.instances, notes)


def _choice(given: list[str], choices: Mapping[str, str]) -> str | None:
    """The meaning of a key or of the whole word; None if it is neither."""
    if not given:
        return None
    return choices.get(given[0], given[0] if given[0] in set(choices.values()) else None)
