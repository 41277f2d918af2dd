"""Finds the plane that most background points lie on: the table top.

RANSAC in numpy rather than Open3D's `segment_plane`, whose result still varies from run to run
with a fixed seed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float

_HYPOTHESES = 200
_SCORED = 500
_INLIER_M = 0.01
_SMALLEST_SHARE = 0.25
_FEWEST_POINTS = 50
_REFINEMENTS = 2


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane seen by the camera.

    Attributes:
        normal: Unit vector (3,) in the camera optical frame, pointing to the camera's side.
        height_m: Distance of the camera from the plane.
        share: Share of the points that lie on it, within 1 cm.
    """

    normal: Float
    height_m: float
    share: float


def find_plane(points: Float, rng: np.random.Generator) -> Plane | None:
    """The plane with the most points.

    Args:
        points: (N, 3) finite, metres, camera optical frame; a few thousand are enough.
        rng: Draws the hypotheses.

    Returns:
        The plane, or None if there are too few points or none holds a quarter of them.
    """
    if len(points) < _FEWEST_POINTS:
        return None
    candidate = _best_hypothesis(points, rng)
    if candidate is None:
        return None
    normal, offset = candidate
    for _ in range(_REFINEMENTS):
        near = np.abs(points @ normal - offset) <= _INLIER_M
        if np.count_nonzero(near) < 3:
            return None
        normal, offset = _fit(points[near])
    share = float(np.mean(np.abs(points @ normal - offset) <= _INLIER_M))
    if share < _SMALLEST_SHARE:
        return None
    # The camera is the origin: it lies on the side where the normal's offset is negative.
    if offset > 0.0:
        normal, offset = -normal, -offset
    return Plane(normal, -offset, share)


def _best_hypothesis(points: Float, rng: np.random.Generator) -> tuple[Float, float] | None:
    """Normal and offset of the plane through three points that has the most points near it."""
    corners = points[rng.integers(len(points), size=(_HYPOTHESES, 3))]  # (K, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 1e-9
    if not proper.any():
        return None
    normals = normals[proper] / lengths[proper, None]
    offsets = np.einsum("kc,kc->k", normals, corners[proper, 0])
    scored = points[:: max(1, len(points) // _SCORED)]  # (S, 3)
    distances = np.abs(scored @ normals.T - offsets)  # (S, K)
    best = int(np.argmax(np.count_nonzero(distances <= _INLIER_M, axis=0)))
    return normals[best], float(offsets[best])


def _fit(points: Float) -> tuple[Float, float]:
    """Least-squares plane of points (N, 3): unit normal and its offset from the origin."""
    centre = points.mean(axis=0)
    offsets = points - centre
    normal = np.linalg.eigh(offsets.T @ offsets)[1][:, 0]
    return normal, float(normal @ centre)
