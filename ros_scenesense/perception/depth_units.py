"""Tells from the readings alone when metres and millimetres were confused.

A table that a depth camera can see stands between some centimetres and some metres away. A factor
of a thousand leaves that range by far in either direction.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

NEAREST_M = 0.05
FARTHEST_M = 20.0


def unit_fault(depth: npt.NDArray[np.floating]) -> str | None:
    """Why the readings of a depth image cannot be metres of a tabletop scene; None if they can.

    Args:
        depth: (H, W) metres along the optical axis; 0 or not finite where nothing was read.

    Returns:
        The fault in words, or None; also None for an image without any reading.
    """
    readings = depth[np.isfinite(depth) & (depth > 0.0)]
    if readings.size == 0:
        return None
    median = float(np.median(readings.astype(np.float64)))
    if median > FARTHEST_M:
        return (
            f"half of the depth readings are beyond {median:.4g} m, no table is so far away: they "
            "look like millimetres that are taken for metres"
        )
    if median < NEAREST_M:
        return (
            f"half of the depth readings are nearer than {median:.4g} m, no camera sees so near: "
            "they look like metres that are taken for millimetres"
        )
    return None
