"""Real scenes for the experiment on grounding: what was seen, and what a person said of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from ros_scenesense.experiments.grounding_scenes import ObservedScene, Truth, observe
from ros_scenesense.experiments.relation_labels import RelationLabel
from ros_scenesense.experiments.tosd import Split, Tosd, TosdScene, instances_in
from ros_scenesense.scene import Distance, Position


def observed_scenes(tosd: Tosd, split: Split, seed: int) -> Iterator[ObservedScene]:
    """The labelled scenes of a set; their truths are the labels of pairs of located objects.

    Args:
        tosd: The scenes and their labels.
        split: The set.
        seed: Of the points that are drawn from the clouds; same seed, same scenes.

    Raises:
        DatasetError: If a scene is damaged, or labels name objects that it lacks.
    """
    for number, scene in enumerate(tosd.labelled(split)):
        yield observed_scene(scene, np.random.default_rng([seed, number]))


def observed_scene(scene: TosdScene, rng: np.random.Generator) -> ObservedScene:
    """A labelled scene; labels of objects without enough depth readings are left out."""
    seen, places = observe(scene.frame, instances_in(scene.frame), rng)
    return replace(seen, truths=list(_truths(scene.labels, places)))


def _truths(labels: Iterable[RelationLabel], places: dict[int, int]) -> Iterator[Truth]:
    """One truth per pair, with both of its labels."""
    said: dict[tuple[int, int], tuple[Position | None, Distance | None]] = {}
    for label in labels:
        first, second = (_place(name, places) for name in (label.object, label.reference))
        if first is None or second is None:
            continue
        # A distance is the same in either direction: it joins the position that was said.
        pair = (second, first) if (second, first) in said else (first, second)
        position, distance = said.get(pair, (None, None))
        said[pair] = (label.position or position, label.distance or distance)
        if label.position is not None and pair != (first, second):
            said[first, second] = said.pop(pair)
    for (first, second), (position, distance) in said.items():
        yield Truth(first, second, position, distance)


def _place(name: str, places: dict[int, int]) -> int | None:
    return places.get(int(name.removeprefix("object_")))
