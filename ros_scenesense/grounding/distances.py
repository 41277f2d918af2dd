"""The distance between two objects, and the paper's three distance relations.

Paper, section *Qualitative Spatial Representation*, equation of the distance heuristics: touching
up to 1 cm, far from 1 m on, by "the 10 % closest distances between pairs of points". Read
literally, over all pairs of points, two stacked cubes would not touch: most of their points are
centimetres apart. Our reading: the mean of the smallest 10 % of the distances from each point of
one cloud to its nearest neighbour in the other; of the two directions, the smaller mean.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
# Clouds this far apart surely do not touch; so many of their points tell how far, by so much.
_SURELY_APART_M = 0.05
_THINNED_POINTS = 48
_THINNED_ERROR_M = 0.05


def closest_distance(first: cKDTree, second: cKDTree) -> float:
    """The distance (metres) between two clouds by the 10 % closest distances; symmetric."""
    return float(_exact(first, second).mean())


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


def closest_distances(clouds: Sequence[Float]) -> dict[tuple[int, int], Float]:
    """The 10 % closest distances of every unordered pair of clouds, metres, in no order.

    Of the two directions, the one with the smaller mean. Clouds whose boxes are more than 5 cm
    apart are thinned first, unless they may be about one metre apart: where nothing is decided, a
    few millimetres do not matter.

    Args:
        clouds: Each (N, 3) metres, N >= 1, all in one frame.

    Returns:
        Distances (K,) by (i, j) with i < j.
    """
    from scipy.spatial import cKDTree  # slow to import: only where relations are computed

    nearest = _least_distances(clouds)
    thinned = _thinned_distances(clouds)
    trees: dict[int, cKDTree] = {}

    def tree(index: int) -> cKDTree:
        if index not in trees:
            trees[index] = cKDTree(clouds[index])
        return trees[index]

    found = {}
    for i in range(len(clouds)):
        for j in range(i + 1, len(clouds)):
            rough = min((thinned[i, j], thinned[j, i]), key=np.mean)
            decided = nearest[i, j] > _SURELY_APART_M and not _may_be_far(float(rough.mean()))
            found[i, j] = rough if decided else _exact(tree(i), tree(j))
    return found


def distance_relations(
    closest: Mapping[tuple[int, int], Float],
) -> dict[tuple[int, int], tuple[Distance, float]]:
    """The distance relation of every unordered pair, and its confidence, by (i, j) with i < j.

    Args:
        closest: As `closest_distances` gives them, or `contact.seen_distances`.
    """
    return {pair: name_distance(float(distances.mean())) for pair, distances in closest.items()}


def _exact(first: cKDTree, second: cKDTree) -> Float:
    return min((_closest(first, second), _closest(second, first)), key=np.mean)


def _closest(cloud: cKDTree, other: cKDTree) -> Float:
    """The closest 10 % of the distances from the points of one cloud to the other."""
    distances = other.query(cloud.data)[0]
    count = int(np.ceil(CLOSEST_SHARE * len(distances)))
    return np.asarray(np.partition(distances, count - 1)[:count])


def _may_be_far(distance_m: float) -> bool:
    return abs(distance_m - FAR_M) <= _FAR_MARGIN_M + _THINNED_ERROR_M


def _thinned_distances(clouds: Sequence[Float]) -> Float:
    """The closest 10 % of the distances from thinned cloud i to thinned cloud j: (n, n, K)."""
    if not clouds:
        return np.empty((0, 0, 1))
    chosen = [np.linspace(0, len(cloud) - 1, _THINNED_POINTS).astype(np.intp) for cloud in clouds]
    thin = np.stack([cloud[index] for cloud, index in zip(clouds, chosen, strict=True)])
    flat = thin.reshape(-1, 3)
    squares = (flat**2).sum(axis=1)
    between = squares[:, None] + squares[None] - 2.0 * flat @ flat.T
    shape = (len(clouds), _THINNED_POINTS, len(clouds), _THINNED_POINTS)
    nearest = between.reshape(shape).min(axis=3).transpose(0, 2, 1)  # (n, n, points of i)
    count = int(np.ceil(CLOSEST_SHARE * _THINNED_POINTS))
    return np.sqrt(np.maximum(0.0, np.partition(nearest, count - 1, axis=-1)[..., :count]))


def _least_distances(clouds: Sequence[Float]) -> Float:
    """Lower bounds (n, n) of the distances between the points of two clouds."""
    low = np.array([cloud.min(axis=0) for cloud in clouds]).reshape(-1, 3)
    high = np.array([cloud.max(axis=0) for cloud in clouds]).reshape(-1, 3)
    between = low[:, None] - high[None]  # (n, n, 3), positive where i lies beyond j
    gaps = np.maximum(0.0, np.maximum(between, between.swapaxes(0, 1)))
    return np.asarray(np.linalg.norm(gaps, axis=-1))
