"""How much of an object's outline is its own: the rest is hidden by others or cut off."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float

# What is so much nearer, metres, hides what it borders on; nearer things touch it.
_NEARER_M = 0.015


def hidden_shares(instances: npt.NDArray[np.uint16], depth: npt.NDArray[np.floating]) -> Float:
    """Share of each object's outline at which something nearer, or the image's edge, cuts it off.

    Args:
        instances: (H, W) instance ids, 0 = background.
        depth: (H, W) metres along the optical axis; 0 or not finite where nothing was read.

    Returns:
        (largest id + 1,) from 0 to 1, by instance id.
    """
    size = int(instances.max()) + 1
    outline, hidden = np.zeros(size), np.zeros(size)
    for axis in (0, 1):
        first = instances[:-1] if axis == 0 else instances[:, :-1]
        second = instances[1:] if axis == 0 else instances[:, 1:]
        y, x = np.nonzero(first != second)
        here, there = (y, x), (y + 1, x) if axis == 0 else (y, x + 1)
        for mine, other in ((here, there), (there, here)):
            owner, beside = instances[mine], instances[other]
            outline += np.bincount(owner, minlength=size)
            near, far = _inward(depth, other, mine), _inward(depth, mine, other)
            covered = (beside > 0) & (far - near > _NEARER_M)
            hidden += np.bincount(owner[covered], minlength=size)
    for edge in (instances[0], instances[-1], instances[:, 0], instances[:, -1]):
        at_edge = np.bincount(edge, minlength=size)
        outline += at_edge
        hidden += at_edge
    shares = hidden / np.maximum(outline, 1.0)
    shares[0] = 0.0
    return shares


Pixels = tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]
# Right at a border depth cameras mix both sides.
_INWARD = 3


def _inward(depth: npt.NDArray[np.floating], at: Pixels, across: Pixels) -> Float:
    """Depth a few pixels away from the border, on the side of `at`; NaN without a reading."""
    y = np.clip(at[0] + _INWARD * (at[0] - across[0]), 0, depth.shape[0] - 1)
    x = np.clip(at[1] + _INWARD * (at[1] - across[1]), 0, depth.shape[1] - 1)
    read = depth[y, x].astype(np.float64)
    return np.where(read > 0.0, read, np.nan)
