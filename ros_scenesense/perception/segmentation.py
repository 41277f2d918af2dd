"""Tells the objects of a frame apart where nobody gave instance ids.

What stands out of the table plane is split wherever neighbouring pixels lie apart in space. Objects
that touch stay one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Float
from ros_scenesense.perception.clouds import background_points
from ros_scenesense.perception.plane import find_plane

_SAMPLE = 4000
_LOWEST_M = 0.01
_HIGHEST_M = 0.6
_GAP_M = 0.015
_FEWEST_READINGS = 60


def segment(points: Float, rng: np.random.Generator) -> npt.NDArray[np.uint16]:
    """Instance ids of the objects on the table.

    Args:
        points: (H, W, 3) metres in the optical frame; z is not finite where there is no reading.
        rng: Draws the samples that the plane is found in.

    Returns:
        (H, W) ids from 1, 0 = background.

    Raises:
        FrameError: If there is no plane that objects could stand on.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    everything = np.zeros(points.shape[:2], np.uint16)
    plane = find_plane(background_points(points, everything, _SAMPLE, rng), rng)
    if plane is None:
        raise FrameError(
            "no table was found: a quarter of the depth readings must lie on one plane; point the "
            "camera so that more of the table is seen"
        )
    height_m = points @ plane.normal + plane.height_m
    standing = np.isfinite(height_m) & (height_m > _LOWEST_M) & (height_m < _HIGHEST_M)
    pixels = np.arange(standing.size).reshape(standing.shape)
    ends = [
        _joined(points, standing, pixels, slice(None, -1), slice(1, None), axis) for axis in (0, 1)
    ]
    first, second = (np.concatenate(side) for side in zip(*ends, strict=True))
    graph = coo_array(
        (np.ones(len(first), np.int8), (first, second)), shape=(standing.size, standing.size)
    )
    labels = connected_components(graph, directed=False)[1].reshape(standing.shape)
    return _numbered(np.where(standing, labels, -1))


def _joined(
    points: Float,
    standing: npt.NDArray[np.bool_],
    pixels: npt.NDArray[np.intp],
    before: slice,
    after: slice,
    axis: int,
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Neighbouring pixels along an axis that stand out of the table and lie close in space."""
    one = (before, slice(None)) if axis == 0 else (slice(None), before)
    other = (after, slice(None)) if axis == 0 else (slice(None), after)
    close = np.linalg.norm(points[one] - points[other], axis=-1) < _GAP_M
    close &= standing[one] & standing[other]
    return pixels[one][close], pixels[other][close]


def _numbered(labels: npt.NDArray[np.integer]) -> npt.NDArray[np.uint16]:
    """Ids from 1 for the regions that are large enough, in the order of their numbers."""
    found, counts = np.unique(labels[labels >= 0], return_counts=True)
    kept = found[counts >= _FEWEST_READINGS][: np.iinfo(np.uint16).max]
    ids = np.searchsorted(kept, labels)
    known = np.isin(labels, kept)
    return np.where(known, ids + 1, 0).astype(np.uint16)
