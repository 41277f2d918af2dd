"""Attributes of an object, measured from its points and pixels; None where they cannot be told.

All of them are of what the camera sees: an object that others hide, or that the image cuts off, has
a colour, but neither a size nor a shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float
from ros_scenesense.perception.boxes import percentiles
from ros_scenesense.scene import Size, Surface

BOX, CYLINDER, SPHERE, OTHER = "box", "cylinder", "sphere", "other"
SHAPES = (BOX, CYLINDER, SPHERE, OTHER)


@dataclass(frozen=True)
class Attributes:
    """What was measured of an object; None = it cannot be told.

    Attributes:
        size: Class of its size.
        surface: Whether its top is flat.
        shape: One of `SHAPES`.
    """

    size: Size | None = None
    surface: Surface | None = None
    shape: str | None = None


def measure_attributes(points: Float, whole: bool) -> Attributes:
    """Measures size, top surface and shape.

    Args:
        points: (N, 3) metres along right, away and up of the viewer's gravity-up frame, whose
            origin is the camera.
        whole: Whether nothing hides the object or cuts it off.
    """
    if not whole or len(points) < _FEWEST_POINTS:
        return Attributes()
    low, high = percentiles(points, (_LOWEST_PERCENT, 100.0 - _LOWEST_PERCENT))
    extent = (high - low) / (1.0 - 2.0 * _LOWEST_PERCENT / 100.0)
    if min(extent[0], extent[2]) < _SMALLEST_M:
        return Attributes()
    distance_m = float(np.median(np.linalg.norm(points, axis=1)))
    error_m = _ERROR_M + _ERROR_GROWTH * distance_m**2
    shape, diameter_m = _shape(points, extent, error_m)
    measure_m = diameter_m or float(np.sqrt(extent[0] * extent[2]))
    return Attributes(_size(measure_m), _surface(points, extent, error_m), shape)


_FEWEST_POINTS = 60
_LOWEST_PERCENT = 3.0
_SMALLEST_M = 0.01
# Readings of depth cameras err by about so much, and more with the square of the distance.
_ERROR_M = 0.002
_ERROR_GROWTH = 0.0025

# Classes of the square root of width times height, or of the diameter of a sphere.
_SMALL_TO_M = 0.063
_LARGE_FROM_M = 0.0935
# So near a limit, as a share of it, the class cannot be told.
_DOUBTFUL = 0.03


def _size(measure_m: float) -> Size | None:
    for limit_m in (_SMALL_TO_M, _LARGE_FROM_M):
        if abs(measure_m / limit_m - 1.0) < _DOUBTFUL:
            return None
    if measure_m < _SMALL_TO_M:
        return Size.SMALL
    return Size.LARGE if measure_m > _LARGE_FROM_M else Size.MEDIUM


def _top(points: Float) -> float:
    """Height of the top, stray points left out."""
    return float(percentiles(points[:, 2], (98.0,))[0])


# A top is flat if it is as wide as this share of the object, all at one height.
_FLAT_SHARE = 0.75
_ROUND_SHARE = 0.65
# An open container whose opening is wider does not carry a small cube.
_WIDEST_OPENING_M = 0.1
_DEEP_M = 0.02
_OPEN_SHARE = 0.06


def _surface(points: Float, extent: Float, error_m: float) -> Surface | None:
    top = _top(points)
    level = points[points[:, 2] > top - 2.0 * error_m]
    if len(level) < 10:
        return None
    ends = percentiles(level[:, 0], (3.0, 97.0))
    share = float(ends[1] - ends[0]) / 0.94 / float(extent[0])
    if share < _ROUND_SHARE:
        return Surface.IRREGULAR
    if share < _FLAT_SHARE:
        return None
    if _is_open(points, level, top) and extent[0] > _WIDEST_OPENING_M:
        return Surface.IRREGULAR
    return Surface.FLAT


def _is_open(points: Float, level: Float, top: float) -> bool:
    """Whether one sees into it: below its rim, but behind the rim's near side."""
    near, far = percentiles(level[:, 1], (3.0, 97.0))
    left, right = percentiles(level[:, 0], (10.0, 90.0))
    deep = (points[:, 2] < top - _DEEP_M) & (points[:, 1] > near + 0.3 * (far - near))
    deep &= (points[:, 0] > left) & (points[:, 0] < right)
    return float(np.mean(deep)) > _OPEN_SHARE


# What fits none of the forms better than this share of its size is none of them.
_WORST_FIT = 0.05
# The second best form must fit so many times worse, or the two cannot be told apart.
_CLEARLY_WORSE = 1.3
_FEWEST_ON_SIDE = 30
# Among the rest are mixed pixels.
_KEPT_SHARE = 0.9


def _shape(points: Float, extent: Float, error_m: float) -> tuple[str | None, float | None]:
    """The form that fits best, and the diameter if it is a sphere."""
    measure_m = float(np.sqrt(extent[0] * extent[2]))
    top = _top(points)
    side = points[points[:, 2] < top - max(3.0 * error_m, 0.12 * float(extent[2]))]
    if len(side) < _FEWEST_ON_SIDE:
        return None, None
    sphere_m, radius_m = _sphere_misfit(points, measure_m)
    misfits = {
        SPHERE: sphere_m,
        CYLINDER: _cylinder_misfit(side[:, :2], float(extent[0])),
        BOX: _box_misfit(side[:, :2]),
    }
    best, second, *_ = sorted(misfits, key=misfits.__getitem__)
    if misfits[best] > max(1.2 * error_m, _WORST_FIT * measure_m):
        return OTHER, None
    if misfits[second] < _CLEARLY_WORSE * misfits[best]:
        return None, None
    return best, 2.0 * radius_m if best == SPHERE else None


def _rms(residuals: Float) -> float:
    """Root mean square of the residuals, the worst tenth left out."""
    square = np.sort(np.square(residuals))
    return float(np.sqrt(square[: max(1, int(_KEPT_SHARE * len(square)))].mean()))


def _sphere_misfit(points: Float, measure_m: float) -> tuple[float, float]:
    """How badly a sphere fits, metres, and its radius."""
    middle = points.mean(axis=0)
    moved = points - middle
    terms = np.column_stack([2.0 * moved, np.ones(len(moved))])
    solution = np.linalg.lstsq(terms, np.square(moved).sum(axis=1), rcond=None)[0]
    centre = solution[:3]
    radius_m = float(np.sqrt(max(0.0, solution[3] + centre @ centre)))
    if not 0.4 * measure_m < radius_m < 0.8 * measure_m:
        return np.inf, radius_m
    return _rms(np.linalg.norm(moved - centre, axis=1) - radius_m), radius_m


def _cylinder_misfit(places: Float, width_m: float) -> float:
    """How badly an upright cylinder fits the places (N, 2) of points on its side, metres."""
    middle = places.mean(axis=0)
    moved = places - middle
    terms = np.column_stack([2.0 * moved, np.ones(len(moved))])
    solution = np.linalg.lstsq(terms, np.square(moved).sum(axis=1), rcond=None)[0]
    centre = solution[:2]
    radius_m = float(np.sqrt(max(0.0, solution[2] + centre @ centre)))
    if not 0.4 * width_m < radius_m < 0.65 * width_m:
        return np.inf
    return _rms(np.linalg.norm(moved - centre, axis=1) - radius_m)


def _box_misfit(places: Float) -> float:
    """How badly an upright box of any yaw fits the places (N, 2) of points on its sides, metres.

    The camera sees at most two of its sides, the nearer ones.
    """
    angles = np.radians(np.arange(0.0, 90.0, 3.0))
    cosine, sine = np.cos(angles), np.sin(angles)
    # All yaws at once: (30, N). Of a turned box both sides that are seen are near ones.
    one = np.outer(cosine, places[:, 1]) - np.outer(sine, places[:, 0])
    other = np.outer(sine, places[:, 1]) + np.outer(cosine, places[:, 0])
    # Which of the other two sides is seen depends on where the camera is: the origin.
    other *= np.sign(other.mean(axis=1, keepdims=True))
    rank = int(_LOWEST_PERCENT / 100.0 * (len(places) - 1))
    missed_one = one - np.partition(one, rank, axis=1)[:, rank, None]
    missed_other = other - np.partition(other, rank, axis=1)[:, rank, None]
    nearer = missed_one < missed_other
    square = np.minimum(
        np.square(missed_one - _mean_where(missed_one, nearer)),
        np.square(missed_other - _mean_where(missed_other, ~nearer)),
    )
    kept = max(1, int(_KEPT_SHARE * len(places)))
    square = np.partition(square, kept - 1, axis=1)[:, :kept]
    return float(np.sqrt(square.mean(axis=1).min()))


def _mean_where(values: Float, mask: npt.NDArray[np.bool_]) -> Float:
    """Mean of each row's values under the mask, (rows, 1); 0 where there are none."""
    count = np.maximum(np.count_nonzero(mask, axis=1), 1)
    return np.asarray((np.where(mask, values, 0.0).sum(axis=1) / count)[:, None])
