"""The visual words of a scene: histograms of where objects are, and how near, pair by pair.

Paper, section *Metric Spatial Representation*: 2D histograms over the angles theta and phi of the
object's points, seen from the reference, ground the positions; 1D histograms of the 10 % closest
distances ground the distances. All are normalised. Two things are ours: the points that lie inside
the box of the reference are counted in one bin of their own, for of them the angles say nothing
(*in* would look like every direction); and histograms are blurred by a bin, so that a few examples
speak for their neighbourhood too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float
from ros_scenesense.grounding.extent import Extent, completed

THETA_BINS = 12
PHI_BINS = 24
POSITION_BINS = THETA_BINS * PHI_BINS + 1
"""The angles, theta (from up) before phi (from right, towards away), then the share inside."""

DISTANCE_EDGES_M = (
    *(0.0, 0.0025, 0.005, 0.0075, 0.01, 0.0125, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.075),
    *(0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.4, 1.7, 2.0),
)
"""Fine where the meaning of a distance may change; the last bin has no upper edge."""
DISTANCE_BINS = len(DISTANCE_EDGES_M)

_BLUR_BINS = 1.0
# The rows of theta within 45 degrees of the horizon.
_LEVEL = slice(THETA_BINS // 4, THETA_BINS - THETA_BINS // 4)


@dataclass(frozen=True, eq=False)
class PairHistograms:
    """What was seen of one directed pair.

    Attributes:
        position: (POSITION_BINS,) sums to 1.
        distance: (DISTANCE_BINS,) sums to 1.
        azimuth_rad: Direction from the reference's centre to the object's about up: 0 = right,
            pi / 2 = away.
        yaw_rad: By how much the axes are turned to the left of the viewer's.
    """

    position: Float
    distance: Float
    azimuth_rad: float
    yaw_rad: float = 0.0

    @property
    def is_level(self) -> bool:
        """Whether the azimuth says something: most of the object is beside the reference."""
        angles = self.position[:-1].reshape(THETA_BINS, PHI_BINS)
        return bool(angles[_LEVEL].sum() > 0.5)

    def along(self, yaw_rad: float) -> PairHistograms:
        """The same pair, along axes that are turned by this angle to the left of the viewer's."""
        change = yaw_rad - self.yaw_rad
        if change == 0.0:
            return self
        azimuth = math.remainder(self.azimuth_rad - change, 2.0 * math.pi)
        return PairHistograms(turn(self.position, change), self.distance, azimuth, yaw_rad)


@dataclass(frozen=True, eq=False)
class SceneHistograms:
    """What was seen of every directed pair of n objects; entry (i, j) is object i by reference j.

    The diagonal means nothing.

    Attributes:
        position: (n, n, POSITION_BINS).
        distance: (n, n, DISTANCE_BINS), symmetric.
        azimuth_rad: (n, n).
        yaw_rad: By how much the axes are turned to the left of the viewer's.
    """

    position: Float
    distance: Float
    azimuth_rad: Float
    yaw_rad: float = 0.0

    def pair(self, i: int, j: int) -> PairHistograms:
        """What was seen of object i with respect to reference j."""
        azimuth = float(self.azimuth_rad[i, j])
        return PairHistograms(self.position[i, j], self.distance[i, j], azimuth, self.yaw_rad)


def describe(
    extents: Sequence[Extent],
    distances: Mapping[tuple[int, int], Float],
    viewpoint: Float,
    yaw_rad: float = 0.0,
) -> SceneHistograms:
    """The histograms of all pairs of a scene.

    Args:
        extents: The objects in the naming axes.
        distances: Of the same objects, as `qsr.measure_distances` gives them; in whichever axes.
        viewpoint: (3,) where the camera is, in the same axes as the objects.
        yaw_rad: By how much the axes are turned to the left of the viewer's.
    """
    count = len(extents)
    distance = np.zeros((count, count, DISTANCE_BINS))
    for (i, j), values in distances.items():
        distance[i, j] = distance[j, i] = _distance_histogram(values)
    low, high = completed(extents, viewpoint)
    middle = (low + high) / 2.0
    between = middle[:, None] - middle[None]  # from j to i
    azimuth = np.arctan2(between[..., 1], between[..., 0])
    return SceneHistograms(_positions(extents, low, high), distance, azimuth, yaw_rad)


def turn(position: Float, yaw_rad: float) -> Float:
    """Position histograms (..., POSITION_BINS) along axes turned about up by an angle (left)."""
    bins = yaw_rad / (2.0 * math.pi) * PHI_BINS
    whole = math.floor(bins)
    share = bins - whole
    angles = position[..., :-1].reshape(*position.shape[:-1], THETA_BINS, PHI_BINS)
    near, far = (np.roll(angles, -shift, axis=-1) for shift in (whole, whole + 1))
    mixed = (1.0 - share) * near + share * far
    flat = mixed.reshape(*position.shape[:-1], THETA_BINS * PHI_BINS)
    return np.concatenate([flat, position[..., -1:]], axis=-1)


def _positions(extents: Sequence[Extent], low: Float, high: Float) -> Float:
    """Blurred and normalised histograms (n, n, POSITION_BINS)."""
    count = len(extents)
    if not count:
        return np.zeros((0, 0, POSITION_BINS))
    points = np.concatenate([one.points for one in extents])  # (P, 3)
    sizes = np.array([len(one.points) for one in extents])
    owners = np.repeat(np.arange(count), sizes) * POSITION_BINS
    counts = np.empty((count, count, POSITION_BINS))
    for j in range(count):
        right, away, up = (points - (low[j] + high[j]) / 2.0).T
        theta = np.arctan2(np.hypot(right, away), up) * (THETA_BINS / math.pi)
        phi = (np.arctan2(away, right) / (2.0 * math.pi) + 0.5) * PHI_BINS
        bins = np.minimum(theta.astype(np.intp), THETA_BINS - 1) * PHI_BINS
        bins += np.minimum(phi.astype(np.intp), PHI_BINS - 1)
        inside = np.ones(len(points), dtype=np.bool_)
        for axis, values in enumerate(points.T):
            inside &= (values >= low[j, axis]) & (values <= high[j, axis])
        bins[inside] = POSITION_BINS - 1
        hits = np.bincount(owners + bins, minlength=count * POSITION_BINS)
        counts[:, j] = hits.reshape(count, POSITION_BINS)
    shares = counts / sizes[:, None, None]
    angles = shares[..., :-1].reshape(count, count, THETA_BINS, PHI_BINS)
    blurred = (_BLUR_THETA @ angles @ _BLUR_PHI).reshape(count, count, -1)
    return np.concatenate([blurred, shares[..., -1:]], axis=-1)


def _distance_histogram(distances: Float) -> Float:
    """Normalised histogram (DISTANCE_BINS,) of distances in metres, blurred over the neighbours."""
    bins = np.searchsorted(DISTANCE_EDGES_M, distances, side="right") - 1
    shares = np.bincount(bins, minlength=DISTANCE_BINS) / len(distances)
    return np.asarray(_BLUR_DISTANCE @ shares)


def _kernel(bins: int, wraps: bool) -> Float:
    """Matrix (bins, bins) that blurs histograms; its columns sum to 1."""
    steps = np.abs(np.arange(bins)[:, None] - np.arange(bins)[None])
    if wraps:
        steps = np.minimum(steps, bins - steps)
    weights = np.where(steps > 3.0 * _BLUR_BINS, 0.0, np.exp(-0.5 * (steps / _BLUR_BINS) ** 2))
    return np.asarray(weights / weights.sum(axis=0))


_BLUR_THETA = _kernel(THETA_BINS, wraps=False)
_BLUR_PHI = _kernel(PHI_BINS, wraps=True)
# A quarter of a bin's share goes to each neighbour: more would wash out what 1 cm means.
_BLUR_DISTANCE = np.eye(DISTANCE_BINS) * 0.5
_BLUR_DISTANCE += 0.25 * (np.eye(DISTANCE_BINS, k=1) + np.eye(DISTANCE_BINS, k=-1))
_BLUR_DISTANCE /= _BLUR_DISTANCE.sum(axis=0)
