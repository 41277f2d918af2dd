"""What the networks of the experiments on estimation are shown, and the answers to it.

LeNet and AlexNet get pixels and have a slot for every structure and object; our network is asked
one question at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.inputs import unpack
from ros_scenesense.experiments.estimation_views import Question, Region, View
from ros_scenesense.scene import Task
from ros_scenesense.stages.attention import SIDE

if TYPE_CHECKING:
    from ros_scenesense.attention.networks.answers import TrainedNetwork
    from ros_scenesense.attention.networks.samples import Samples

Float = npt.NDArray[np.float32]
SLOTS = 5
"""Structures and objects that a whole image or a region has at most."""
NO_NUMBERS: Float = np.zeros(0, np.float32)
COLUMN = {Task.STABILITY: 0, Task.OCCLUSION: 1}
"""Outputs of our network."""


@dataclass(frozen=True)
class Way:
    """A way to estimate.

    Attributes:
        kind: Which network.
        attends: Whether reasoning comes first and the network is shown regions of interest.
        pixels: Whether it is shown pixels.
        geometry: Whether a query network gets the numbers beside the image.
        segments: Whether objects are told apart by segmentation, not by the simulator's ids.
    """

    kind: str
    attends: bool
    pixels: bool = True
    geometry: bool = True
    segments: bool = False


WAYS = {
    "lenet": Way("lenet", attends=False),
    "lenet_att": Way("lenet", attends=True),
    "alexnet": Way("alexnet", attends=False),
    "alexnet_att": Way("alexnet", attends=True),
    "same_channels": Way("query", attends=False),
    "query": Way("query", attends=True),
    "query_pixels": Way("query", attends=True, geometry=False),
    "query_geometry": Way("query", attends=True, pixels=False),
    "query_segmented": Way("query", attends=True, segments=True),
}


def samples_of(way: Way, views: Sequence[View], knowledge: str) -> Samples:
    """What a way learns from in some scenes: who attends, only from what reasoning lacks."""
    from ros_scenesense.attention.networks.samples import Samples

    images, numbers, answers, groups = [], [], [], []
    rows: list[tuple[Float, Float, Float]]
    for view in views:
        attended = view.reasoned[knowledge].lacking
        if way.kind != "query":
            places = attended.regions if way.attends else [None]
            rows = [(pixels(way, view, each), NO_NUMBERS, _answers(view, each)) for each in places]
        elif way.attends:
            rows = [
                (*shown(way, each), _literals(view, each.target, [each.task]))
                for each in attended.questions
            ]
        else:
            rows = [(*shown(way, each), _literals(view, each.target, Task)) for each in view.whole]
        for image, beside, answer in rows:
            images.append(image)
            numbers.append(beside)
            answers.append(answer)
            groups.append(view.number)
    if not images:
        # Of no scene: the training says so.
        return Samples(*(np.zeros((0, 1), np.float32),) * 3, np.zeros(0, np.int64))
    return Samples(np.stack(images), np.stack(numbers), np.stack(answers), np.array(groups))


def pixels(way: Way, view: View, region: Region | None) -> Float:
    """The whole image, or a region of it, (3, side, side) from 0 to 1."""
    picture = view.picture if region is None else region.picture
    steps = picture.lenet if way.kind == "lenet" else picture.alexnet
    return steps.astype(np.float32) / np.float32(255.0)


def shown(way: Way, question: Question) -> tuple[Float, Float]:
    """A question to our network: image (6, side, side), and numbers (6,); 0 what it lacks."""
    image, numbers = unpack(question.image, SIDE), question.numbers
    return (
        image if way.pixels else np.zeros_like(image),
        numbers if way.geometry else np.zeros_like(numbers),
    )


def _literals(view: View, name: str, tasks: Iterable[Task]) -> Float:
    row = np.full(2, np.nan, np.float32)
    for task in tasks:
        label = view.labels[name, task]
        if label is not None:
            row[COLUMN[task]] = label
    return row


def _answers(view: View, region: Region | None) -> Float:
    """Structures from left to right, then objects; NaN where there is none, or no label."""
    row = np.full(2 * SLOTS, np.nan, np.float32)
    objects = view.objects if region is None else region.objects
    for slot, members in enumerate(structures_of(view, objects)):
        truth = dict(view.structures)[members]
        row[slot] = np.nan if truth is None else truth
    for slot, name in enumerate(objects):
        label = view.labels[name, Task.OCCLUSION]
        row[SLOTS + slot] = np.nan if label is None else label
    return row


def structures_of(view: View, objects: Sequence[str]) -> list[tuple[str, ...]]:
    """The structures that some objects are part of, in the order of the slots."""
    return [members for members, _ in view.structures if not set(members).isdisjoint(objects)]


def answered(
    trained: TrainedNetwork, shown: Sequence[Sequence[tuple[Float, Float]]]
) -> Iterable[Float]:
    """Probabilities for what each scene shows, a hundred scenes at a time."""
    for start in range(0, len(shown), 100):
        part = shown[start : start + 100]
        inputs = [each for scene in part for each in scene]
        if not inputs:
            yield from (np.zeros((0, 0), np.float32) for _ in part)
            continue
        answers = trained.probabilities(*map(_stacked, zip(*inputs, strict=True)))
        ends = np.cumsum([len(scene) for scene in part])
        yield from np.split(answers, ends[:-1])


_stacked: Callable[[Sequence[Float]], Float] = np.stack
