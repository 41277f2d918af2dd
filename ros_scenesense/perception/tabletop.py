"""What rises from the table: heights above its top, and how exactly they are known.

Real table tops are not planes to a depth camera: its readings bend by some millimetres over the
image and scatter more with the distance. Both are measured on the table itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float
from ros_scenesense.perception.plane import Plane

Image = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

HIGHEST_M = 0.8
"""Nothing on a table is higher."""


@dataclass(frozen=True, eq=False)
class Tabletop:
    """The table that a camera sees, and everything relative to it.

    Attributes:
        plane: Of its top.
        heights: (H, W) metres above the top; NaN without a reading.
        least: (H, W) metres from which on a pixel is not of the table.
        right: (H, W) metres to the right along the top.
        away: (H, W) metres away from the camera along the top.
        outline: (K, 1, 2) float32, convex hull of the visible top in these two coordinates.
    """

    plane: Plane
    heights: Image
    least: Image
    right: Image
    away: Image
    outline: Image

    @property
    def rising(self) -> Mask:
        """Pixels (H, W) that are of something on the table, specks of noise left out."""
        with np.errstate(invalid="ignore"):
            above = (self.heights > self.least) & (self.heights < HIGHEST_M)
        return cv2.morphologyEx(above.view(np.uint8), cv2.MORPH_OPEN, _SPECK).view(np.bool_)

    def share_over(self, rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]) -> float:
        """Share of some pixels that are over the visible top, not beside it."""
        some = np.s_[:: max(1, len(rows) // _ENOUGH)]
        pixels = rows[some], columns[some]
        places = np.stack([self.right[pixels], self.away[pixels]], axis=1)
        places = places[np.isfinite(places[:, 0])]
        if len(places) == 0 or len(self.outline) == 0:
            return 0.0
        # Inside a convex outline a place is on the same side of all edges as the middle is.
        corners = self.outline[:, 0]
        edges = np.roll(corners, -1, axis=0) - corners
        normals = np.stack([-edges[:, 1], edges[:, 0]], axis=1)
        normals /= np.maximum(np.linalg.norm(edges, axis=1), 1e-9)[:, None]
        offsets = np.einsum("kc,kc->k", normals, corners)
        normals *= np.sign(normals @ corners.mean(axis=0) - offsets)[:, None]
        offsets = np.einsum("kc,kc->k", normals, corners)
        inside = (places @ normals.T - offsets).min(axis=1)
        return float(np.mean(inside > _RIM_M))


def measure_tabletop(points: Image, plane: Plane, rng: np.random.Generator) -> Tabletop:
    """Measures everything relative to the table.

    Args:
        points: (H, W, 3) metres in the optical frame; NaN without a reading.
        plane: Of the table top.
        rng: Draws the samples of the table.
    """
    up = plane.normal
    forward = np.array([0.0, 0.0, 1.0]) if abs(up[2]) < _LOOKS_DOWN else np.array([0.0, -1.0, 0.0])
    away = forward - (forward @ up) * up
    away /= np.linalg.norm(away)
    axes = np.stack([np.cross(away, up), away, up]).astype(np.float32)
    shape = points.shape[:2]
    # One matrix product for all three coordinates.
    turned = (points.reshape(-1, 3) @ axes.T).reshape(*shape, 3)
    right, beyond = turned[..., 0], turned[..., 1]
    heights = turned[..., 2] + np.float32(plane.height_m)
    depth = points[..., 2]
    with np.errstate(invalid="ignore"):
        near = np.flatnonzero(np.abs(heights) < _NEAR_TOP_M)
    near = near[rng.integers(len(near), size=_SAMPLE)] if len(near) > _SAMPLE else near
    x, y, z = (image.ravel()[near].astype(np.float64) for image in (right, beyond, depth))
    bend = _bend(x, y, heights.ravel()[near].astype(np.float64))
    heights = heights - np.clip(_polynomial(right, beyond, bend), -_LARGEST_BEND_M, _LARGEST_BEND_M)
    growth = _scatter(z, heights.ravel()[near].astype(np.float64))
    least = np.maximum(_LEAST_M, _CERTAINTY * (growth[0] + growth[1] * np.square(depth)))
    on_top = np.abs(heights.ravel()[near]) < least.ravel()[near]
    outline = _outline(np.stack([x[on_top], y[on_top]], axis=1))
    return Tabletop(plane, heights, least.astype(np.float32), right, beyond, outline)


_SPECK = np.ones((3, 3), dtype=np.uint8)
_SAMPLE = 8000
_ENOUGH = 200
# Of the table's points almost all are nearer its plane than this, of objects few.
_NEAR_TOP_M = 0.02
_LARGEST_BEND_M = 0.01
# What is on the table begins at so many standard deviations of the table's own readings.
_CERTAINTY = 4.0
_LEAST_M = 0.006
_LARGEST_SCATTER_M = 0.01
# What is so near the edge of the visible top is a wall or a chair that it borders on.
_RIM_M = 0.01
_LOOKS_DOWN = 0.98
_BINS = 8
_FEWEST_IN_BIN = 50
# From the median of absolute deviations to the standard deviation of a normal distribution.
_MAD = 1.4826


def _polynomial(x: npt.NDArray[np.floating], y: npt.NDArray[np.floating], bend: Float) -> Image:
    """Heights of the bent table top at places on it."""
    a, b, c, d, e, f = (np.float32(value) for value in bend)
    return np.asarray(a + x * (b + d * x + e * y) + y * (c + f * y), dtype=np.float32)


def _bend(x: Float, y: Float, heights: Float) -> Float:
    """Coefficients (6,) of the quadratic surface through the table's points, in two passes."""
    bend: Float = np.zeros(6)
    if len(x) < _FEWEST_IN_BIN:
        return bend
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    for limit in (_NEAR_TOP_M, _NEAR_TOP_M / 2.0):
        kept = np.abs(heights - terms @ bend) < limit
        if np.count_nonzero(kept) < _FEWEST_IN_BIN:
            break
        bend = np.asarray(np.linalg.lstsq(terms[kept], heights[kept], rcond=None)[0])
    return bend


def _scatter(depth: Float, heights: Float) -> tuple[np.float32, np.float32]:
    """How the readings of the table scatter: standard deviation = first + second * depth**2."""
    order = np.argsort(depth)
    parts = [part for part in np.array_split(order, _BINS) if len(part) >= _FEWEST_IN_BIN]
    if len(parts) < 2:
        return np.float32(_LEAST_M / _CERTAINTY), np.float32(0.0)
    scatter = [
        min(_LARGEST_SCATTER_M, _MAD * float(np.median(np.abs(heights[part])))) for part in parts
    ]
    square = [float(np.median(depth[part])) ** 2 for part in parts]
    terms = np.stack([np.ones(len(parts)), square], axis=1)
    first, second = np.linalg.lstsq(terms, np.array(scatter), rcond=None)[0]
    if second < 0.0:
        first, second = float(np.median(scatter)), 0.0
    return np.float32(max(first, 0.0)), np.float32(second)


def _outline(places: Float) -> Image:
    """Convex hull of the places (N, 2) on the table, single stray ones left out."""
    if len(places) < _FEWEST_IN_BIN:
        return np.zeros((0, 1, 2), dtype=np.float32)
    cells = np.floor(places / _CELL_M).astype(np.int64)
    _, cell_of, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    kept = counts[cell_of.ravel()] >= 3
    if np.count_nonzero(kept) < 3:
        kept[:] = True
    return np.asarray(cv2.convexHull(places[kept].astype(np.float32)), dtype=np.float32)


_CELL_M = 0.05
