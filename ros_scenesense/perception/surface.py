"""Surfaces of what stands on the table: smoothed points, normals, curvature, evened-out colour.

Everything is worked out in the part of the image that holds the objects. Holes in the depth image
are filled from next to them for the sake of the filters; callers mask them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Intrinsics

Image = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]
Labels = npt.NDArray[np.int32]
Value = TypeVar("Value", np.float32, np.int32)

LIGHTNESS_WEIGHT = 0.35
"""Light and shadow change the lightness of a surface, hardly its hue."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A part of an image.

    Attributes:
        points: (h, w, 3) smoothed, metres in the optical frame.
        normals: (h, w, 3) unit vectors towards the camera.
        bend: (h, w) by how much, as the length of a difference of normals, the surface bends over
            a few pixels along that of the two image axes along which it is more concave;
            negative = concave.
        lab: (h, w, 3) CIELAB, smoothed within edges, lightness weighted down.
    """

    points: Image
    normals: Image
    bend: Image
    lab: Image


def measure_surface(
    color: npt.NDArray[np.uint8], depth: Image, intrinsics: Intrinsics, row: int, column: int
) -> Surface:
    """Measures the surfaces in a part of an image.

    Args:
        color: (h, w, 3) RGB of the part.
        depth: (h, w) metres of the part; 0 without a reading.
        intrinsics: Of the whole image.
        row: Of the whole image, where the part begins.
        column: Of the whole image, where the part begins.
    """
    filled = spread(depth, depth > 0.0)
    # In inverse depth the noise of triangulating cameras is about the same at all distances.
    inverse = np.asarray(1.0 / filled, dtype=np.float32)
    for _ in range(2):
        smoothed = cv2.bilateralFilter(inverse, _WINDOW, _INVERSE_STEP, _REACH)
        inverse = np.asarray(smoothed, dtype=np.float32)
    z = np.asarray(1.0 / inverse, dtype=np.float32)
    height, width = z.shape
    u = ((np.arange(column, column + width) - intrinsics.cx) / intrinsics.fx).astype(np.float32)
    v = ((np.arange(row, row + height) - intrinsics.cy) / intrinsics.fy).astype(np.float32)
    points = np.stack([z * u, z * v[:, None], z], axis=-1)
    normals = _normals(points)
    bend = np.minimum(_bend(points, normals, axis=0), _bend(points, normals, axis=1))
    return Surface(points, normals, bend, _lab(color))


def spread(values: npt.NDArray[Value], known: Mask) -> npt.NDArray[Value]:
    """The values (h, w) with those of unknown pixels taken from the nearest known one."""
    if not known.any():
        return values
    _, nearest = cv2.distanceTransformWithLabels(
        (~known).view(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL
    )
    value_of = np.zeros(int(nearest.max()) + 1, dtype=values.dtype)
    value_of[nearest[known]] = values[known]
    return np.asarray(value_of[nearest])


_WINDOW = 9
_REACH = 4.0
# Readings whose inverses, 1 per metre, differ by much more than this are of two surfaces.
_INVERSE_STEP = 0.012
_NORMAL_REACH = 3
_BEND_REACH = 4
_COLOR_WINDOW = 7
_COLOR_STEP = 12.0


def _normals(points: Image) -> Image:
    k = _NORMAL_REACH
    along_u, along_v = np.zeros_like(points), np.zeros_like(points)
    np.subtract(points[:, 2 * k :], points[:, : -2 * k], out=along_u[:, k:-k])
    np.subtract(points[2 * k :], points[: -2 * k], out=along_v[k:-k])
    normals = np.empty_like(points)
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        normals[..., x] = along_v[..., y] * along_u[..., z] - along_v[..., z] * along_u[..., y]
    lengths = np.sqrt(np.einsum("hwc,hwc->hw", normals, normals))
    normals /= np.maximum(lengths, np.float32(1e-12))[..., None]
    return normals


def _bend(points: Image, normals: Image, axis: int) -> Image:
    k = _BEND_REACH
    before = np.s_[: -2 * k] if axis == 0 else np.s_[:, : -2 * k]
    after = np.s_[2 * k :] if axis == 0 else np.s_[:, 2 * k :]
    inner = np.s_[k:-k] if axis == 0 else np.s_[:, k:-k]
    step, turn = points[after] - points[before], normals[after] - normals[before]
    lengths = np.sqrt(np.einsum("hwc,hwc->hw", step, step))
    bend = np.zeros(points.shape[:2], dtype=np.float32)
    bend[inner] = np.einsum("hwc,hwc->hw", turn, step) / np.maximum(lengths, np.float32(1e-9))
    return bend


def _lab(color: npt.NDArray[np.uint8]) -> Image:
    # In 8 bits lightness counts to 255 and the other two from 128; four times faster to filter.
    lab = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2LAB)
    lab = cv2.bilateralFilter(lab, _COLOR_WINDOW, _COLOR_STEP, 3.0)
    scale = np.array([LIGHTNESS_WEIGHT * 100.0 / 255.0, 1.0, 1.0], dtype=np.float32)
    return np.asarray((lab - np.array([0.0, 128.0, 128.0], dtype=np.float32)) * scale)
