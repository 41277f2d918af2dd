"""An object as grounding needs it: its points and its box."""

from __future__ import annotations

from dataclasses import dataclass

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
