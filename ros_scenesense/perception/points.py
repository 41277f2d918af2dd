"""From a depth image to points, in single precision: half the memory, twice the speed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Intrinsics


def points_of(depth: npt.NDArray[np.float32], intrinsics: Intrinsics) -> npt.NDArray[np.float32]:
    """Points (H, W, 3) of all pixels in the optical frame, metres; NaN without a reading.

    A hundredth of a millimetre is what single precision can tell at ten metres.
    """
    points = np.empty((*depth.shape, 3), dtype=np.float32)
    z = points[..., 2]
    with np.errstate(invalid="ignore"):
        np.copyto(z, np.where((depth > 0.0) & (depth < np.inf), depth, np.float32(np.nan)))
    u = (np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx
    v = (np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy
    np.multiply(z, u.astype(np.float32), out=points[..., 0])
    np.multiply(z, v.astype(np.float32)[:, None], out=points[..., 1])
    return points
