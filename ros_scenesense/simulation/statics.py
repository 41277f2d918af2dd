"""What is certain of a stack before physics has spoken: whether it can stand at all, or must.

What stands on an object, taken together, is carried by contacts that lie within the outlines of
both, seen from above. If its centre of mass lies outside one of them it falls, whatever the forces.
If both touch with flat faces and it lies well inside both, everywhere in the stack, nothing moves.
All else is open. So candidates that cannot be as wished need not be built. Labels are never made
here: whatever a dataset holds was tested by physics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ros_scenesense.geometry import Float
from ros_scenesense.simulation.arrangements import Piece
from ros_scenesense.simulation.catalogue import Catalogue, CatalogueItem
from ros_scenesense.simulation.stability import JITTER_M

# Two neighbours that are displaced against each other come nearer to the edge, and the contacts
# that Bullet finds under a round face lie a little inside it.
SAFE_M = 2.0 * JITTER_M + 0.005


class Statics:
    """Judges stacks of the objects of a catalogue.

    Args:
        catalogue: Where the forms of the objects are.
    """

    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue
        self._outlines: dict[CatalogueItem, _Outlines] = {}

    def stands(self, stack: Sequence[Piece]) -> bool | None:
        """Whether a stack stands, each piece on the one before; None if only physics can tell."""
        certain = True
        for level in range(1, len(stack)):
            lower, upper = stack[level - 1], stack[level]
            centre = _centre(stack[level:])
            below, above = self._of(lower.item), self._of(upper.item)
            if max(_beyond(below.all, lower, centre), _beyond(above.all, upper, centre)) > 0.0:
                return False
            nearest = max(_beyond(below.top, lower, centre), _beyond(above.base, upper, centre))
            certain = certain and nearest < -SAFE_M
        return True if certain else None

    def _of(self, item: CatalogueItem) -> _Outlines:
        if item not in self._outlines:
            self._outlines[item] = _Outlines(
                np.concatenate(self._catalogue.form(item).convex_parts)
            )
        return self._outlines[item]


# Faces are flat where their corners are at most so far from level.
_LEVEL_M = 0.0003


class _Outlines:
    """Of an object seen from above: faces (F, 3) n, d of polygons, inside which n x + d <= 0.

    `all` is about everything, `base` and `top` about its level faces; None where it has none.
    """

    def __init__(self, corners: Float) -> None:
        heights = corners[:, 2]
        self.all = _outline(corners)
        self.base = _outline(corners[heights < heights.min() + _LEVEL_M])
        self.top = _outline(corners[heights > heights.max() - _LEVEL_M])


def _outline(corners: Float) -> Float | None:
    try:
        return np.asarray(ConvexHull(corners[:, :2]).equations)
    except (QhullError, ValueError):  # a point or a line
        return None


def _centre(pieces: Sequence[Piece]) -> tuple[float, float]:
    """Where the common centre of mass is, seen from above."""
    mass = sum(piece.item.mass_kg for piece in pieces)
    return (
        sum(piece.item.mass_kg * piece.x_m for piece in pieces) / mass,
        sum(piece.item.mass_kg * piece.y_m for piece in pieces) / mass,
    )


def _beyond(outline: Float | None, piece: Piece, place: tuple[float, float]) -> float:
    """How far outside an outline of a piece a place is, metres; negative inside."""
    if outline is None:
        return math.inf
    x, y = place[0] - piece.x_m, place[1] - piece.y_m
    cosine, sine = math.cos(piece.yaw_rad), math.sin(piece.yaw_rad)
    local = np.array([x * cosine + y * sine, y * cosine - x * sine, 1.0])
    return float((outline @ local).max())
