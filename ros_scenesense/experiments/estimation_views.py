"""A scene as the networks of the experiments on estimation need it: labels, beliefs, pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.scene import Task

Bytes = npt.NDArray[np.uint8]
Literal = tuple[str, Task]


@dataclass(frozen=True, eq=False)
class Picture:
    """A part of an image as LeNet and AlexNet get it, (3, side, side) with 256 steps."""

    lenet: Bytes
    alexnet: Bytes


@dataclass(frozen=True, eq=False)
class Region:
    """A region of interest.

    Attributes:
        task: Of the literals in question.
        objects: From left to right.
        targets: Those in question.
        picture: Its pixels.
    """

    task: Task
    objects: tuple[str, ...]
    targets: tuple[str, ...]
    picture: Picture


@dataclass(frozen=True, eq=False)
class Question:
    """A literal as the query network is shown it; the image is packed."""

    task: Task
    target: str
    image: bytes
    numbers: npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Attended:
    """What attention makes of literals: regions for LeNet and AlexNet, questions for ours."""

    regions: list[Region]
    questions: list[Question]


@dataclass(frozen=True, eq=False)
class Reasoned:
    """A scene with some knowledge.

    Attributes:
        beliefs: What reasoning says of every literal.
        undecided: What a network is asked.
        lacking: What it may learn from: undecided or wrong, and labelled.
        defaults: What was decided by defaults alone, for who may overrule them.
    """

    beliefs: dict[Literal, Belief]
    undecided: Attended
    lacking: Attended
    defaults: list[Question]


@dataclass(frozen=True, eq=False)
class View:
    """A scene.

    Attributes:
        number: In the dataset.
        objects: Those in the image, from left to right.
        labels: Truth of every literal; None where it is ambiguous.
        structures: Members of every structure, from left to right, with its stability.
        picture: The whole image.
        whole: Every object as a question about the whole image, all other objects marked.
        reasoned: By the names of `estimation_scenes.KNOWLEDGE`.
    """

    number: int
    objects: tuple[str, ...]
    labels: dict[Literal, bool | None]
    structures: list[tuple[tuple[str, ...], bool | None]]
    picture: Picture
    whole: list[Question]
    reasoned: dict[str, Reasoned]
