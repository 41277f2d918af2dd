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


def completed(extents: Sequence[Extent]) -> tuple[Float, Float]:
    """Boxes as they may be when seen from all sides: lower and upper corners, each (n, 3).

    Of most objects only the front is seen: they are taken to be as deep as they are wide.
    """
    low = np.array([one.low for one in extents]).reshape(-1, 3)
    high = np.array([one.high for one in extents]).reshape(-1, 3)
    high[:, 1] = np.maximum(high[:, 1], low[:, 1] + high[:, 0] - low[:, 0])
    return low, high
