"""Finds the plane that most points lie on, and the one of the table top.

RANSAC in numpy rather than Open3D's `segment_plane`, whose result still varies from run to run
with a fixed seed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ros_scenesense.geometry import Float

_HYPOTHESES = 200
_SCORED = 500
_INLIER_M = 0.01
_SMALLEST_SHARE = 0.25
_SMALLEST_TABLE_SHARE = 0.1
_LARGEST_TILT_DEG = 20.0
_LARGEST_ROLL_DEG = 45.0
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
    plane = None if candidate is None else _refined(points, candidate)
    return None if plane is None or plane.share < _SMALLEST_SHARE else plane


def find_table(points: Float, rng: np.random.Generator, up: Float | None = None) -> Plane | None:
    """The plane with the most points among those that a table top can be.

    Args:
        points: (N, 3) finite, metres, camera optical frame, of everything that the camera sees.
        rng: Draws the hypotheses.
        up: (3,) direction against gravity in the optical frame; None if unknown. Then the camera
            is taken to look down at the table, its image more or less upright.

    Returns:
        The plane, or None if there are too few points or no such plane holds enough of them.
    """
    if len(points) < _FEWEST_POINTS:
        return None
    rest = points
    while len(rest) >= max(_FEWEST_POINTS, _SMALLEST_TABLE_SHARE * len(points)):
        candidate = _best_hypothesis(rest, rng)
        plane = None if candidate is None else _refined(rest, candidate)
        if plane is None or plane.share * len(rest) < _SMALLEST_TABLE_SHARE * len(points):
            return None
        if _may_be_table(plane, up):
            return replace(plane, share=plane.share * len(rest) / len(points))
        # A wall: the table is among what is left.
        rest = rest[np.abs(rest @ plane.normal + plane.height_m) > _INLIER_M]
    return None


def _may_be_table(plane: Plane, up: Float | None) -> bool:
    if up is not None:
        return float(plane.normal @ up) > math.cos(math.radians(_LARGEST_TILT_DEG))
    # The image's up is -y. A wall before a camera that looks down faces a little downwards.
    sideways, upward = abs(float(plane.normal[0])), -float(plane.normal[1])
    return sideways < math.sin(math.radians(_LARGEST_ROLL_DEG)) and upward > -0.05


def _refined(points: Float, candidate: tuple[Float, float]) -> Plane | None:
    """The least-squares plane of the points near a candidate; None if they are too few."""
    normal, offset = candidate
    for _ in range(_REFINEMENTS):
        near = np.abs(points @ normal - offset) <= _INLIER_M
        if np.count_nonzero(near) < 3:
            return None
        normal, offset = _fit(points[near])
    share = float(np.mean(np.abs(points @ normal - offset) <= _INLIER_M))
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
