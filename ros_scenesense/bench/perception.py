"""How well objects are told apart and described without instance ids, and how fast.

Measured on simulated frames, with and without the noise of a depth camera, that nothing in
`perception/` was tuned to: its numbers were chosen on frames of other seeds.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ros_scenesense.bench.crowds import HEIGHT, WIDTH, Picture, Studio
from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.errors import FrameError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import PerceivedObject
from ros_scenesense.messages.scenes import KnownObject, Scene
from ros_scenesense.perception.attributes import BOX, CYLINDER, OTHER, SPHERE
from ros_scenesense.results import Table
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.noise import KINECT, NONE, PRESETS, noisy_frame
from ros_scenesense.stages.grounding_engine import OWN, GroundingConfiguration, GroundingEngine

_CROWDS = (5, 10, 20)
_MASKS_MS = {5: 40.0, 10: 60.0, 20: 110.0}
_SEGMENTATION_MS = 150.0
_ATTRIBUTES = ("size", "surface", "shape", "color")
FIGURES = (
    Figure(
        "segmentation_iou70",
        "share of the objects of simulated 640x480 frames of which the segmentation without "
        "instance ids finds more than 70 % (intersection over union)",
        at_least=0.93,
    ),
    Figure("segmentation_iou70_kinect", "the same with the noise of a Kinect", at_least=0.93),
    Figure("segmentation_iou70_one_color", "the same, stacks of two to five objects of one colour"),
    Figure("segmentation_iou70_one_color_kinect", "the same with the noise of a Kinect"),
    *(
        Figure(f"attribute_{name}", f"share of right ones among the {words} that are told, Kinect")
        for name, words in zip(
            _ATTRIBUTES, ("sizes", "top surfaces", "shapes", "colours"), strict=True
        )
    ),
    *(
        Figure(
            f"perceive_masks_ms_{count}",
            f"from depth and instance ids to relations, 640x480, {count} objects, median, ms",
            at_most=_MASKS_MS[count],
        )
        for count in _CROWDS
    ),
    *(
        Figure(
            f"perceive_segmented_ms_{count}",
            f"the same without instance ids, {count} objects, median, ms",
            at_most=_MASKS_MS[count] + _SEGMENTATION_MS,
        )
        for count in _CROWDS
    ),
    Figure(
        "perceive_growth",
        "exponent of the number of objects with which the time with instance ids grows",
        at_most=2.0,
    ),
)
Cell = str | int | float | None
# Seeds of frames; what perception was fitted to has seeds from 1000 to 1004.
_FIRST_SEED = 7000
_OVERLAP = 0.7
_REPEATS = 5


def measure(options: BenchOptions) -> Measured:
    """Finds and describes the objects of simulated frames, and times it on crowds."""
    seed = _FIRST_SEED + options.seed
    scenes, stacks, crowds = (3, 2, 1) if options.quick else (100, 60, 4)
    mixed = list(_scenes(scenes, seed))
    studio = Studio()
    try:
        one_color = [
            studio.stack_of_one_color(np.random.default_rng([seed, number]))
            for number in range(stacks)
        ]
        crowded = {
            count: [
                studio.crowd(count, np.random.default_rng([seed, count, number]))
                for number in range(crowds)
            ]
            for count in _CROWDS
        }
    finally:
        studio.close()
    figures: dict[str, float] = {}
    rows: list[list[Cell]] = []
    for title, name, pictures in (
        ("towers, spread, intersection", "segmentation_iou70", mixed),
        ("stacks of one colour", "segmentation_iou70_one_color", one_color),
        ("crowds of 5, 10 and 20", None, [one for group in crowded.values() for one in group]),
    ):
        for noise in (NONE, KINECT):
            score = _segmentation(pictures, noise, seed)
            rows.append([title, noise, score.objects, score.share, score.mean, score.surplus])
            if name is not None:
                figures[name + ("" if noise == NONE else f"_{noise}")] = score.share
    columns = ["frames", "noise", "objects", "IoU > .7", "mean IoU", "found and not there"]
    tables = {"Segmentation without instance ids": Table(columns=columns, rows=rows)}
    told = [row for noise in (NONE, KINECT) for row in _attributes(mixed, noise, seed)]
    figures |= {f"attribute_{row[0]}": float(str(row[2])) for row in told if row[1] == KINECT}
    columns = ["attribute", "noise", "right, of those told", "told", "most frequent mistakes"]
    tables["Attributes measured"] = Table(columns=columns, rows=told)
    timed, growth = _times(crowded, seed, 2 if options.quick else _REPEATS)
    figures |= timed
    figures["perceive_growth"] = growth
    return Measured(figures, tables)


def best_overlaps(
    true: npt.NDArray[np.uint16], found: npt.NDArray[np.uint16]
) -> npt.NDArray[np.float64]:
    """Of each true object, from id 1 on, the best intersection over union with a found one."""
    rows, columns = int(true.max()) + 1, int(found.max()) + 1
    codes = true.astype(np.int64) * columns + found
    both = np.bincount(codes.ravel(), minlength=rows * columns).reshape(rows, columns)
    union = both.sum(axis=1)[:, None] + both.sum(axis=0)[None] - both
    if columns == 1:
        return np.zeros(rows - 1)
    return np.asarray((both / np.maximum(union, 1))[1:, 1:].max(axis=1))


def _scenes(count: int, seed: int) -> Iterator[Picture]:
    engine = SimulationEngine(SimulationConfiguration(width=WIDTH, height=HEIGHT))
    try:
        for index in range(count):
            scene = engine.scene(seed, index)
            yield Picture(scene.frame, scene.objects)
    finally:
        engine.close()


def _seen(frame: Frame, noise: str, seed: int, number: int) -> Frame:
    return noisy_frame(frame, PRESETS[noise], np.random.default_rng([seed, number]))


def _scene_of(frame: Frame, objects: Sequence[KnownObject]) -> Scene:
    """A scene that gives names alone."""
    names = [KnownObject(instance=one.instance, name=one.name) for one in objects]
    stamp = Stamp.of(frame.stamp_ns)
    return Scene(stamp=stamp, scene_id="bench-0000", mode="testing", objects=names)


@dataclass(frozen=True)
class _Score:
    """How well objects were found: how many there are, shares, and how many are too much."""

    objects: int
    share: float
    mean: float
    surplus: int


def _segmentation(pictures: Sequence[Picture], noise: str, seed: int) -> _Score:
    engine = GroundingEngine(GroundingConfiguration(instances=OWN))
    overlaps: list[npt.NDArray[np.float64]] = []
    surplus = 0
    for number, picture in enumerate(pictures):
        true = picture.frame.instances
        assert true is not None
        frame = replace(_seen(picture.frame, noise, seed, number), instances=None)
        try:
            found = engine.ground(frame, _scene_of(frame, [])).instances
        except FrameError:
            found = np.zeros_like(true)
        overlaps.append(best_overlaps(true, found))
        surplus += max(0, int(found.max()) - len(picture.objects))
    every = np.concatenate(overlaps)
    return _Score(len(every), float(np.mean(every > _OVERLAP)), float(every.mean()), surplus)


def _attributes(pictures: Sequence[Picture], noise: str, seed: int) -> list[list[Cell]]:
    """Rows (attribute, noise, share right of those told, share told, mistakes)."""
    engine = GroundingEngine(GroundingConfiguration())
    right: Counter[str] = Counter()
    told: Counter[str] = Counter()
    wrong: dict[str, Counter[str]] = {name: Counter() for name in _ATTRIBUTES}
    total = 0
    for number, picture in enumerate(pictures):
        frame = _seen(picture.frame, noise, seed, number)
        result = engine.ground(frame, _scene_of(frame, picture.objects))
        for truth, found in zip(picture.objects, result.objects.objects, strict=True):
            total += 1
            for name in _ATTRIBUTES:
                expected, value = _expected(truth, name), _value(found, name)
                if value is None:
                    continue
                told[name] += 1
                if value == expected:
                    right[name] += 1
                else:
                    wrong[name][f"{truth.size} {truth.shape}: {value}"] += 1
    return [
        [
            name,
            noise,
            right[name] / max(told[name], 1),
            told[name] / total,
            ", ".join(f"{words} ({count})" for words, count in wrong[name].most_common(3)),
        ]
        for name in _ATTRIBUTES
    ]


_FORMS = {
    BOX: ("cube", "cracker_box", "box", "tray"),
    CYLINDER: ("cylinder",),
    SPHERE: ("sphere", "apple"),
}


def _expected(truth: KnownObject, name: str) -> str:
    if name != "shape":
        return str(getattr(truth, name))
    return next((form for form, shapes in _FORMS.items() if truth.shape in shapes), OTHER)


def _value(found: PerceivedObject, name: str) -> str | None:
    attribute = getattr(found, name)
    return None if attribute is None else str(attribute.value)


def _times(
    crowded: dict[int, list[Picture]], seed: int, repeats: int
) -> tuple[dict[str, float], float]:
    """Median milliseconds by figure, and the exponent of growth with instance ids."""
    given = GroundingEngine(GroundingConfiguration())
    own = GroundingEngine(GroundingConfiguration(instances=OWN))
    figures = {}
    for count, pictures in crowded.items():
        with_ids, without = [], []
        for number, picture in enumerate(pictures):
            frame = _seen(picture.frame, KINECT, seed, number)
            scene = _scene_of(frame, picture.objects)
            bare = replace(frame, instances=None)
            for repeat in range(repeats):
                masks_ms = _milliseconds(given, frame, scene)
                segmented_ms = _milliseconds(own, bare, _scene_of(frame, []))
                if repeat:  # the first warms up
                    with_ids.append(masks_ms)
                    without.append(segmented_ms)
        figures[f"perceive_masks_ms_{count}"] = float(np.median(with_ids))
        figures[f"perceive_segmented_ms_{count}"] = float(np.median(without))
    medians = [figures[f"perceive_masks_ms_{count}"] for count in crowded]
    growth = np.polyfit(np.log(list(crowded)), np.log(medians), 1)[0]
    return figures, float(growth)


def _milliseconds(engine: GroundingEngine, frame: Frame, scene: Scene) -> float:
    start = time.perf_counter()
    engine.ground(frame, scene)
    return (time.perf_counter() - start) * 1e3
