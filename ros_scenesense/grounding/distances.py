"""The distance between two objects, and the paper's three distance relations.

Paper, section *Qualitative Spatial Representation*, equation of the distance heuristics: touching
up to 1 cm, far from 1 m on, by "the 10 % closest distances between pairs of points". Read
literally, over all pairs of points, two stacked cubes would not touch: most of their points are
centimetres apart. Our reading: the mean of the smallest 10 % of the distances from each point of
one cloud to its nearest neighbour in the other; of the two directions, the smaller mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ros_scenesense.geometry import Float
from ros_scenesense.scene import Distance

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

TOUCHING_M = 0.01
FAR_M = 1.0
CLOSEST_SHARE = 0.1

# So far from a threshold the confidence is full.
_TOUCHING_MARGIN_M = 0.01
_FAR_MARGIN_M = 0.1


def closest_distance(first: cKDTree, second: cKDTree) -> float:
    """The distance (metres) between two clouds by the 10 % closest distances; symmetric."""
    return min(_closest_mean(first, second), _closest_mean(second, first))


def name_distance(distance_m: float) -> tuple[Distance, float]:
    """The relation of two objects at a distance, and its confidence.

    The confidence is 0.5 at a threshold and grows with the margin to 1: over 1 cm around
    touching, over 10 cm around far.
    """
    margin = min(
        abs(distance_m - TOUCHING_M) / _TOUCHING_MARGIN_M, abs(distance_m - FAR_M) / _FAR_MARGIN_M
    )
    confidence = 0.5 + 0.5 * min(1.0, margin)
    if distance_m <= TOUCHING_M:
        return Distance.TOUCHING, confidence
    return (Distance.NOT_TOUCHING if distance_m < FAR_M else Distance.FAR), confidence


def distance_relations(
    clouds: Sequence[Float], seen_gaps: Float | None = None
) -> dict[tuple[int, int], tuple[Distance, float]]:
    """The distance relation of every unordered pair of clouds.

    The nearest neighbours are searched only where the boxes around the clouds leave the result
    open; the result is the same with or without this shortcut.

    Args:
        clouds: Each (N, 3) metres, N >= 1, all in one frame.
        seen_gaps: (n, n) from `contact.seen_gaps`: where it is smaller it is the distance. None
            gives the paper's rule alone.

    Returns:
        Relation and confidence by (i, j) with i < j.
    """
    from scipy.spatial import cKDTree  # slow to import: only where relations are computed

    nearest, farthest = _bounds(clouds)
    if seen_gaps is None:
        seen_gaps = np.full(nearest.shape, np.inf)
    trees: dict[int, cKDTree] = {}

    def tree(index: int) -> cKDTree:
        if index not in trees:
            trees[index] = cKDTree(clouds[index])
        return trees[index]

    found = {}
    for i in range(len(clouds)):
        for j in range(i + 1, len(clouds)):
            limit = float(seen_gaps[i, j])
            at_least = name_distance(min(limit, float(nearest[i, j])))
            at_most = name_distance(min(limit, float(farthest[i, j])))
            # Full confidence at both ends in the same relation: so it is everywhere between.
            if at_least == at_most and at_least[1] == 1.0:
                found[i, j] = at_least
            else:
                found[i, j] = name_distance(min(limit, closest_distance(tree(i), tree(j))))
    return found


def _closest_mean(cloud: cKDTree, other: cKDTree) -> float:
    distances = other.query(cloud.data)[0]
    count = int(np.ceil(CLOSEST_SHARE * len(distances)))
    return float(np.partition(distances, count - 1)[:count].mean())


def _bounds(clouds: Sequence[Float]) -> tuple[Float, Float]:
    """Lower and upper bounds (n, n) of the distances between the points of two clouds."""
    low = np.array([cloud.min(axis=0) for cloud in clouds]).reshape(-1, 3)
    high = np.array([cloud.max(axis=0) for cloud in clouds]).reshape(-1, 3)
    between = low[:, None] - high[None]  # (n, n, 3), positive where i lies beyond j
    gaps = np.maximum(0.0, np.maximum(between, between.swapaxes(0, 1)))
    reaches = np.maximum(-between, -between.swapaxes(0, 1))
    return np.linalg.norm(gaps, axis=-1), np.linalg.norm(reaches, axis=-1)
