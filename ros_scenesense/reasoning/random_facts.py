"""Random scenes as facts, for benchmarks and tests of reasoning without images."""

from __future__ import annotations

import itertools

import numpy as np

from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject
from ros_scenesense.scene import Distance, Position, Size, Surface

_SIDEWAYS = (Position.LEFT, Position.RIGHT, Position.FRONT, Position.BEHIND)


def random_facts(count: int, generator: np.random.Generator) -> SceneFacts:
    """A scene of stacks with all its relations and attributes, shaped like a grounded one.

    Args:
        count: Number of objects.
        generator: Source of randomness; same state, same scene.
    """
    names = [f"object_{index}" for index in range(count)]
    objects = tuple(
        SceneObject(
            name,
            size=tuple(Size)[generator.integers(3)],
            surface=Surface.IRREGULAR if generator.random() < 0.3 else Surface.FLAT,
        )
        for name in names
    )
    places: list[tuple[int, int]] = []  # (stack, level) of each object
    for _ in names:
        if places and generator.random() < 0.6:
            stack = places[generator.integers(len(places))][0]
        else:
            stack = len(places)
        places.append((stack, sum(other == stack for other, _ in places)))
    relations = tuple(
        PairRelation(names[a], names[b], *_relation(places[a], places[b], generator))
        for a, b in itertools.combinations(range(count), 2)
    )
    return SceneFacts(objects, relations)


def _relation(
    one: tuple[int, int], other: tuple[int, int], generator: np.random.Generator
) -> tuple[Position, Distance]:
    if one[0] == other[0]:
        adjacent = abs(one[1] - other[1]) == 1
        position = Position.ABOVE if one[1] > other[1] else Position.BELOW
        return position, Distance.TOUCHING if adjacent else Distance.NOT_TOUCHING
    position = _SIDEWAYS[generator.integers(len(_SIDEWAYS))]
    return position, Distance.FAR if generator.random() < 0.7 else Distance.NOT_TOUCHING
