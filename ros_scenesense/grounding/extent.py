"""An object as grounding needs it: its points and its box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float


@dataclass(frozen=True, eq=False)
class Extent:
    """An object in the naming axes (right, away, up).

    Attributes:
        points: (N, 3) metres, N >= 1.
        low: (3,) lower corner of its box, without stray points.
        high: (3,) upper corner of its box.
    """

    points: Float
    low: Float
    high: Float


def completed(extents: Sequence[Extent], viewpoint: Float) -> tuple[Float, Float]:
    """Boxes as they may be when seen from all sides: lower and upper corners, each (n, 3).

    Of most objects only the front is seen: they are taken to be as deep, along the line of sight,
    as they are wide across it or high, whichever is less.

    Args:
        extents: The objects in naming axes, which may be turned about up against the viewer's.
        viewpoint: (3,) where the camera is, in the same axes.
    """
    low = np.array([one.low for one in extents]).reshape(-1, 3)
    high = np.array([one.high for one in extents]).reshape(-1, 3)
    sight = (low + high)[:, :2] / 2.0 - viewpoint[:2]
    lengths = np.linalg.norm(sight, axis=1, keepdims=True)
    # Straight below the camera an object has no back.
    sight = np.divide(sight, lengths, out=np.zeros_like(sight), where=lengths > 0.0)
    for index, extent in enumerate(extents):
        right, away = sight[index]
        turn = np.array([[away, right], [-right, away]])  # columns: across, along the line of sight
        width, depth = _lengths(extent.points[:, :2] @ turn)
        thickness = min(float(width), float(high[index, 2] - low[index, 2]))
        hidden = max(0.0, thickness - float(depth)) * sight[index]
        low[index, :2] += np.minimum(0.0, hidden)
        high[index, :2] += np.maximum(0.0, hidden)
    return low, high


def _lengths(points: Float) -> Float:
    """From the 3rd to the 97th percentile, as the bounds of boxes are; (D,) of points (N, D)."""
    ordered = np.sort(points, axis=0)
    first, share = divmod(_SIDE * (len(points) - 1), 1.0)
    near = int(first)
    far = min(near + 1, len(points) - 1)
    low = ordered[near] + share * (ordered[far] - ordered[near])
    high = ordered[-1 - near] + share * (ordered[-1 - far] - ordered[-1 - near])
    return np.asarray(high - low)


_SIDE = 0.03
