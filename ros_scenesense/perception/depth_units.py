"""Tells from the readings alone when depth is in other units than was said, as mm taken for metres.

A table that a depth camera can see stands between some centimetres and some metres away. A wrong
factor leaves that range in one direction or the other.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

NEAREST_M = 0.1
FARTHEST_M = 8.0
SPARSE_SHARE = 0.3


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
            f"half of the depth readings are beyond {median:.4g} m, no table is so far away: the "
            f"unit is wrong{_MILLIMETRES if median > 100.0 else ''}"
        )
    if median < NEAREST_M:
        return (
            f"half of the depth readings are nearer than {median:.4g} m, no camera sees so near: "
            f"the unit is wrong{_METRES if median < 0.01 else ''}"
        )
    return None


def sparseness(depth: npt.NDArray[np.floating]) -> str | None:
    """Says that most of a depth image was not read; None if enough was.

    Args:
        depth: (H, W) metres along the optical axis; 0 or not finite where nothing was read.
    """
    share = float(np.mean(np.isfinite(depth) & (depth > 0.0)))
    if share >= SPARSE_SHARE:
        return None
    return f"only {100 * share:.1f} % of the pixels have a depth reading: objects may be missed"


_MILLIMETRES = " (millimetres taken for metres?)"
_METRES = " (metres taken for millimetres?)"
