"""Bounding boxes of point clouds, robust against stray points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ros_scenesense.geometry import Box, Float, Pose, quaternion_of

LOWEST_PERCENT = 3.0
HIGHEST_PERCENT = 97.0


def robust_bounds(points: Float) -> tuple[Float, Float]:
    """Lower and upper corner, each (3,), of a cloud (N, 3), N >= 1, along the axes of its frame.

    They are the 3rd and 97th percentiles: minimum and maximum would follow the mixed pixels that
    depth cameras give at edges.
    """
    low, high = percentiles(points, (LOWEST_PERCENT, HIGHEST_PERCENT))
    return low, high


def percentiles(values: Float, percents: Sequence[float]) -> Float:
    """Percentiles of values (N, ...) along the first axis, (len(percents), ...).

    As `numpy.percentile`, which spends most of its time on other cases than some hundred values.
    """
    ordered = np.sort(values, axis=0)
    places = np.asarray(percents) / 100.0 * (len(ordered) - 1)
    below = np.floor(places).astype(np.intp)
    above = np.minimum(below + 1, len(ordered) - 1)
    share = (places - below).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(ordered[below] + (ordered[above] - ordered[below]) * share)


def oriented_box(low: Float, high: Float, axes: Float) -> Box:
    """The box between two corners, in the frame that the axes are given in.

    Args:
        low: (3,) metres along the axes.
        high: (3,) metres along the axes.
        axes: (3, 3), the rows are the unit vectors of the axes; right-handed.
    """
    x, y, z = (float(value) for value in axes.T @ (low + high) / 2.0)
    width, depth, height = (float(value) for value in high - low)
    return Box(Pose((x, y, z), quaternion_of(axes.T)), (width, depth, height))
