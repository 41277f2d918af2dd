"""An object as a level scanner would read it: its near surface seen from above.

A camera that looks down on a table reads each column of an upright surface many times. Taken
together, these readings are several times as exact as one of them. How far the object reaches to
the left and to the right is told by its pixels alone, whatever depth says at its edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.regions import Rectangle
from ros_scenesense.geometry import Float, Intrinsics

_FEWEST_READINGS = 12
_FEWEST_DIRECTIONS = 4
_DIRECTION_PIXELS = 1.25
"""Width of a direction; with one of a pixel some directions would get no column."""
_BODY_SHARE = 0.4
"""A direction with fewer pixels than this share of the median is a handle, not the body."""
_TOP_M, _TOP_SHARE = 0.006, 0.12
"""What lies at most so far, or such a share of the height, below the highest reading is the top."""
_READ_SHARE = 0.25
"""A direction needs this share of the median number of readings."""
_LEVEL_SIGHT = 0.14
"""Tangent of the angle at which a top has to be seen to tell how far back it reaches."""


@dataclass(frozen=True, eq=False)
class Scan:
    """What is seen of an object, from above, in metres about the camera.

    The second axis goes from the camera through the middle of the object, the first to the right.

    Attributes:
        bearing: Angle of the second axis to the right of the viewer's, radians.
        half_angle: The object reaches so far to both sides of the second axis, radians.
        near: (N, 2) the upright surface, from left to right, one place for each direction.
        angles: (N,) their angles, radians.
        weights: (N,) how often they were read.
        top: (M, 2) places of the upper face; none where it is not seen well enough.
        height: Metres.
    """

    bearing: float
    half_angle: float
    near: Float
    angles: Float
    weights: Float
    top: Float
    height: float


def viewer_axes(up: Float) -> Float:
    """Rows right, away, up (3, 3), level as the viewer sees them, of up (3,) in the optical frame.

    A camera that looks straight down has no direction away; the upper end of its image is taken.
    """
    along = np.array([0.0, 0.0, 1.0]) if abs(up[2]) < 0.999 else np.array([0.0, -1.0, 0.0])
    away = along - (along @ up) * up
    away /= np.linalg.norm(away)
    return np.stack([np.cross(away, up), away, up])


def scan_of(
    depth: npt.NDArray[np.float32],
    intrinsics: Intrinsics,
    mask: npt.NDArray[np.bool_],
    place: Rectangle,
    axes: Float,
) -> Scan | None:
    """Scans one object.

    Args:
        depth: (h, w) metres in a part of the image; 0 or NaN where nothing was read.
        intrinsics: Of the whole image.
        mask: (h, w) the pixels of the object.
        place: Which part.
        axes: As `viewer_axes` gives them.

    Returns:
        None if too little of it was read.
    """
    rows, columns = np.nonzero(mask)
    sight = axes @ np.stack(
        [
            (columns + (place.left - intrinsics.cx)) / intrinsics.fx,
            (rows + (place.top - intrinsics.cy)) / intrinsics.fy,
            np.ones(len(rows)),
        ]
    )
    z = depth[rows, columns].astype(np.float64)
    read = np.isfinite(z) & (z > 0.0)
    # Of what is beneath the camera there is no direction.
    if read.sum() < _FEWEST_READINGS or sight[1].min() <= 0.1:
        return None
    angles = np.arctan2(sight[0], sight[1])
    step = _DIRECTION_PIXELS / (intrinsics.fx * sight[1].min())
    first = np.floor(angles.min() / step)
    index = (np.floor(angles / step) - first).astype(np.intp)
    from_, to = _body(np.bincount(index))
    body = (index >= from_) & (index < to)
    read &= body
    if read.sum() < _FEWEST_READINGS:
        return None
    left, right = _reach(angles[body], rows[body], 0.5 / (intrinsics.fx * sight[1].mean()))
    heights, ranges = z * sight[2], z * np.hypot(sight[0], sight[1])
    low, high = (percentile(heights[read], share) for share in (0.03, 0.97))
    below_top = high - max(_TOP_M, _TOP_SHARE * (high - low))
    upright = read & (heights < below_top)
    if upright.sum() < 0.2 * read.sum():
        upright = read
    seen, distance, weights = _medians(index[upright], ranges[upright], from_, to)
    bearing, half = (left + right) / 2.0, (right - left) / 2.0
    directions = (seen + first + 0.5) * step - bearing
    inside = np.abs(directions) < half
    if inside.sum() > 2 * _FEWEST_DIRECTIONS:
        inside[np.flatnonzero(inside)[[0, -1]]] = False  # what is read there is often behind
    if inside.sum() < _FEWEST_DIRECTIONS:
        return None
    directions, distance, weights = directions[inside], distance[inside], weights[inside]
    on_top = read & (heights > below_top) & (-high > _LEVEL_SIGHT * np.median(distance))
    return Scan(
        bearing=float(bearing),
        half_angle=float(half),
        near=_places(directions, distance),
        angles=directions,
        weights=np.minimum(weights, np.median(weights)),
        top=_places(angles[on_top] - bearing, ranges[on_top]),
        height=float(high - low),
    )


def percentile(values: Float, share: float) -> float:
    """As `numpy.quantile`, which spends most of its time on other cases than some hundred values.

    Args:
        values: (N,), N >= 1.
        share: From 0 to 1.
    """
    place = share * (len(values) - 1)
    low = int(place)
    high = min(low + 1, len(values) - 1)
    ordered = np.partition(values, (low, high))
    return float(ordered[low] + (ordered[high] - ordered[low]) * (place - low))


def _places(angles: Float, ranges: Float) -> Float:
    return np.stack([ranges * np.sin(angles), ranges * np.cos(angles)], axis=1)


def _body(counts: npt.NDArray[np.intp]) -> tuple[int, int]:
    """The directions, from and to, about the fullest one that are full enough: no handle."""
    thin = np.flatnonzero(counts < _BODY_SHARE * np.median(counts[counts > 0]))
    fullest = np.argmax(np.convolve(counts, np.ones(5), "same"))
    before, after = thin[thin < fullest], thin[thin > fullest]
    return int(before[-1]) + 1 if len(before) else 0, int(after[0]) if len(after) else len(counts)


def _reach(angles: Float, rows: npt.NDArray[np.intp], half_pixel: float) -> tuple[float, float]:
    """Angles to the left and to the right that most rows reach."""
    rows = rows - rows.min()
    lefts, rights = np.full(rows.max() + 1, np.inf), np.full(rows.max() + 1, -np.inf)
    np.minimum.at(lefts, rows, angles)
    np.maximum.at(rights, rows, angles)
    there = np.isfinite(lefts)
    left, right = percentile(lefts[there], 0.25), percentile(rights[there], 0.75)
    return left - half_pixel, right + half_pixel


def _medians(
    index: npt.NDArray[np.intp], ranges: Float, from_: int, to: int
) -> tuple[npt.NDArray[np.intp], Float, Float]:
    """The directions that were read often enough, the median range there, and how often."""
    counts = np.bincount(index, minlength=to)
    often = counts >= max(2.0, _READ_SHARE * np.median(counts[counts > 0]))
    often[:from_] = False
    seen = np.flatnonzero(often)
    ordered = ranges[np.lexsort((ranges, index))]
    starts = np.cumsum(counts) - counts
    return seen, ordered[starts[seen] + counts[seen] // 2], counts[seen].astype(np.float64)
