"""The improved rule for positions: containment, then what is over what, then the widest gap.

The first that applies:

1. *in*: most of the object, by its points or by its box, lies inside the box of the reference.
2. *above*, *below*: the footprints of the boxes overlap, and one begins where the other ends.
3. The direction along the axis on which the pair is separated most. Let g be the gap between the
   boxes along an axis (negative where they overlap) and h the smallest, over the axes, sum of half
   extents; then the components of the direction are max(0, g + h). For things of equal size that
   is the direction from centre to centre; a long thing has others beside it along all its length.

The boxes are completed: what a camera in front sees of things is shallow. For containment they are
not: of a container that shows what is in it, the far wall is seen.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float
from ros_scenesense.grounding.extent import Extent, completed
from ros_scenesense.scene import Position

# By axis: said of the object on the positive side, and on the negative one.
_DIRECTIONS = (
    (Position.RIGHT, Position.LEFT),
    (Position.BEHIND, Position.FRONT),
    (Position.ABOVE, Position.BELOW),
)
_IN_SHARE = 0.5
# Footprints that overlap by less, as a share of the smaller one, are beside each other.
_OVERLAP_SHARE = 0.1
# The lower part of an object may sink by this share of the lower height into the box of another.
_INTERLEAVING = 0.4
_THINNEST_M = 1e-4
# Boxes leave out stray points.
_MARGIN_M = 0.05


def positions(
    extents: Sequence[Extent], viewpoint: Float
) -> dict[tuple[int, int], tuple[Position, float]]:
    """The relation of object i to reference j, by (i, j), and its confidence.

    The confidence is the share inside for *in*, 1 for what is over something else, and
    for directions it falls from 1 on the axis to 0.5 between two axes.

    Args:
        extents: The objects in naming axes.
        viewpoint: (3,) where the camera is, in the same axes.
    """
    low, high = completed(extents, viewpoint)
    centre, half = (low + high) / 2.0, (high - low) / 2.0
    offset = centre[:, None] - centre[None]  # (n, n, 3), from j to i
    reach = half[:, None] + half[None]
    gaps = np.abs(offset) - reach
    inside = _shares_inside(extents)
    over = _over(low, high)
    components = np.maximum(0.0, gaps + reach.min(axis=-1, keepdims=True))
    axes = components.argmax(axis=-1)
    second, largest = np.sort(components, axis=-1)[..., 1:].transpose(2, 0, 1)
    clearness = 1.0 - np.arctan2(second, largest) / (np.pi / 2.0)
    found = {}
    for i in range(len(extents)):
        for j in range(len(extents)):
            if i == j:
                continue
            if inside[i, j] > _IN_SHARE and inside[i, j] >= inside[j, i]:
                found[i, j] = Position.IN, float(inside[i, j])
            elif over[i, j] or over[j, i]:
                found[i, j] = (Position.ABOVE if over[i, j] else Position.BELOW), 1.0
            else:
                axis = int(axes[i, j])
                side = 0 if offset[i, j, axis] > 0.0 else 1
                found[i, j] = _DIRECTIONS[axis][side], float(clearness[i, j])
    return found


def _shares_inside(extents: Sequence[Extent]) -> Float:
    """How much of object i, by its points or by its box, is inside the box of object j: (n, n).

    Of what is in a container mostly the top is seen, so its points alone say too little.
    """
    low = np.array([one.low for one in extents])
    high = np.array([one.high for one in extents])
    edges = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    sizes = np.maximum(high - low, _THINNEST_M)
    shares = (np.clip(edges, 0.0, None) / sizes[:, None]).prod(axis=-1)
    # Points of an object are in the box of another only if the two boxes overlap.
    for i, j in np.argwhere((edges > -_MARGIN_M).all(axis=-1)):
        points = extents[i].points
        inside = np.ones(len(points), dtype=np.bool_)
        for axis in range(3):
            inside &= (points[:, axis] >= low[j, axis]) & (points[:, axis] <= high[j, axis])
        shares[i, j] = min(1.0, max(shares[i, j], float(inside.mean())))
    return np.asarray(shares)


def _over(low: Float, high: Float) -> npt.NDArray[np.bool_]:
    """Whether object i is over object j, (n, n)."""
    edges = np.minimum(high[:, None, :2], high[None, :, :2]) - np.maximum(
        low[:, None, :2], low[None, :, :2]
    )
    overlap = np.maximum(0.0, edges).prod(axis=-1)
    footprints = (high - low)[:, :2].prod(axis=-1)
    least = _OVERLAP_SHARE * np.minimum(footprints[:, None], footprints[None])
    heights = high[:, 2] - low[:, 2]
    sunk = _INTERLEAVING * np.minimum(heights[:, None], heights[None])
    higher = (low[:, 2] + high[:, 2])[:, None] > (low[:, 2] + high[:, 2])[None]
    begins = low[:, None, 2] > high[None, :, 2] - sunk
    return np.asarray((overlap > least) & higher & begins)
