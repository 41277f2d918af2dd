"""How much of the distance between two objects the camera has really seen.

The faces with which things stand on each other are hidden, and so is the rim of the lower object
where the upper one juts out towards the camera. Visible points beside a contact therefore often
lie centimetres apart. But what is hidden is no evidence of a gap: only what was seen of it counts.
Of the contacts in simulated stacks the paper's rule alone finds one half, with this one finds more
than .98, and neither finds one where there is none. The price: something held closely above
another object is taken to stand on it. What touches its container from inside, or its neighbour
on the right or left, is seen at a grazing angle there: that much of the distance is not counted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float
from ros_scenesense.grounding.extent import Extent, completed
from ros_scenesense.grounding.gaps import positions
from ros_scenesense.scene import Position

# A steeper view hides so much that its silence says nothing.
_STEEPEST_SLOPE = 1.0
# Boxes of stacked objects may interleave by this share of the lower height: a round object sinks
# into the box of an irregular one.
_LARGEST_INTERLEAVING = 0.4


def seen_distances(
    extents: Sequence[Extent], closest: Mapping[tuple[int, int], Float], viewpoint: Float
) -> dict[tuple[int, int], Float]:
    """The closest distances of every pair, less what was not seen of them.

    Args:
        extents: The objects in naming axes.
        closest: As `distances.closest_distances` gives them for the same objects.
        viewpoint: (3,) where the camera is, in the same axes.
    """
    gaps = seen_gaps(extents, viewpoint)
    places = positions(extents, viewpoint)
    found = {}
    for (i, j), distances in closest.items():
        named = {places[i, j][0], places[j, i][0]}
        hidden = _HIDDEN_INSIDE_M if Position.IN in named else 0.0
        if Position.RIGHT in named:
            hidden = _HIDDEN_BESIDE_M
        found[i, j] = np.minimum(gaps[i, j], np.maximum(0.0, distances - hidden))
    return found


# So much of the distance to a container, and to a neighbour on the right or left, is not seen.
_HIDDEN_INSIDE_M = 0.015
_HIDDEN_BESIDE_M = 0.01


def seen_gaps(extents: Sequence[Extent], viewpoint: Float) -> Float:
    """The vertical gap, as far as it was seen, between the objects of every stacked pair.

    An object is stacked on another if it is higher, their footprints overlap, and no third one is
    stacked between them. A line of sight that just passes the upper object's lower front edge
    falls behind it; what lies below that edge and above that line is hidden. The gap is reduced
    by what is hidden where the contact may be: at the front of the lower object, or under the
    middle of the upper one if that is farther away.

    Args:
        extents: The objects in gravity-up naming axes.
        viewpoint: (3,) where the camera is, in the same axes.

    Returns:
        (n, n) metres, symmetric; infinite for pairs that are not stacked.
    """
    low, high = (corners - viewpoint for corners in completed(extents, viewpoint))
    front, back = low[:, 1], high[:, 1]
    middle = (front + back) / 2.0
    stacked = _stacked(low, high, front, back)
    slopes = np.clip(-high[:, 2] / np.maximum(front, 1e-3), 0.0, _STEEPEST_SLOPE)
    # Rows are the upper objects, columns the lower ones.
    behind_edge = np.maximum(front[None, :], middle[:, None]) - front[:, None]
    gaps = low[:, None, 2] - high[None, :, 2] - slopes[None, :] * np.maximum(0.0, behind_edge)
    seen = np.where(stacked, np.maximum(0.0, gaps), np.inf)
    return np.minimum(seen, seen.T)


def _stacked(low: Float, high: Float, front: Float, back: Float) -> npt.NDArray[np.bool_]:
    """Whether the object of the row stands over that of the column, with none between: (n, n)."""

    def overlap(starts: Float, ends: Float) -> npt.NDArray[np.bool_]:
        return np.asarray(starts[:, None] < ends[None, :]) & np.asarray(
            starts[None, :] < ends[:, None]
        )

    heights = high[:, 2] - low[:, 2]
    allowed = _LARGEST_INTERLEAVING * np.minimum(heights[:, None], heights[None, :])
    higher = (low[:, 2] + high[:, 2])[:, None] > (low[:, 2] + high[:, 2])[None, :]
    above = higher & (low[:, None, 2] > high[None, :, 2] - allowed)
    over = above & overlap(low[:, 0], high[:, 0]) & overlap(front, back)
    between = over.astype(np.int64) @ over.astype(np.int64) > 0
    return over & ~between
