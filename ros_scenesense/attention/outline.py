"""What hides an object: where its outline ends because something nearer begins.

Where one object covers another, depth jumps towards the camera across the outline of the hidden
one. A network finds that out from pixels, but needs many images for it; here it is measured. What
stands on an object begins at the same depth, or is a related object above it: so the shares are
told apart by where they are and by who is there.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

_STEP_M = 0.02
"""What is nearer than the object by more begins a surface of its own; below is noise."""
_WIDTH = 0.02
"""How far beyond the outline is looked, as a share of the width of the image."""
_AROUND = 0.03
"""Within this distance of the outline the depth of the object is averaged."""


@dataclass(frozen=True)
class Outline:
    """Shares of what lies just outside an object, 0 to 1, that is nearer than the object there.

    `upper` and `lower` are above and below the middle of the object; `related` is of objects that
    it stands in a relevant relation to, `other` is whatever else.
    """

    upper_related: float
    upper_other: float
    lower_related: float
    lower_other: float


def outline_of(
    depth: npt.NDArray[np.float32],
    instances: npt.NDArray[np.uint16],
    target: int,
    related: Collection[int],
) -> Outline:
    """What is nearer than an object along its outline.

    Args:
        depth: (H, W) metres; 0 or NaN where nothing was read.
        instances: (H, W) instance ids.
        target: Of the object.
        related: Of the objects that it stands in a relevant relation to.

    Returns:
        The shares; all 0 for an object that is not in the image, or fills it, or has no depth.
    """
    mask = instances == target
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return Outline(0.0, 0.0, 0.0, 0.0)
    width = max(1, round(_WIDTH * mask.shape[1]))
    around = max(1, round(_AROUND * mask.shape[1]))
    top, left = max(0, rows[0] - width), max(0, columns[0] - width)
    part = np.s_[top : rows[-1] + width + 1, left : columns[-1] + width + 1]
    mask, depth, instances = mask[part], depth[part], instances[part]
    read = np.isfinite(depth) & (depth > 0.0)
    inside = (mask & read).astype(np.float32)
    window = (2 * around + 1, 2 * around + 1)
    sums, counts = (
        cv2.boxFilter(each, -1, window, normalize=False, borderType=cv2.BORDER_CONSTANT)
        for each in (np.where(inside > 0.0, depth, 0.0).astype(np.float32), inside)
    )
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * width + 1, 2 * width + 1))
    ring = (cv2.dilate(mask.astype(np.uint8), kernel) > 0) & ~mask
    total = max(1, int(ring.sum()))
    there = sums / np.maximum(counts, 1.0)  # depth of the object next to each pixel
    nearer = ring & read & (counts > 0.5) & (np.where(read, depth, np.inf) < there - _STEP_M)
    upper = np.arange(len(mask))[:, None] < np.mean(np.nonzero(mask)[0])
    known = np.isin(instances, [*related])
    return Outline(
        *(
            float((nearer & half & who).sum() / total)
            for half in (upper, ~upper)
            for who in (known, ~known)
        )
    )
