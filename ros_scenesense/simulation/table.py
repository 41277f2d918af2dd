"""The table as a camera sees it: a square of the plane z = 0, its light and the shadows on it.

It is computed and not rendered: the software renderer takes three times as long for these few
large triangles as for all objects of a scene. Depth agrees with the renderer's to 0.01 mm, and
light follows its model, in which the direction to the lamp is the same everywhere.
"""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float, Intrinsics, Pose
from ros_scenesense.simulation.backgrounds import TABLE_COLOR, viewing_rays
from ros_scenesense.simulation.view import Light

TABLE_EDGE_M = 2.0

Mask = npt.NDArray[np.uint8]


def table_depth(intrinsics: Intrinsics, pose: Pose) -> npt.NDArray[np.float32]:
    """Metres (H, W) along the optical axis to the table; 0 where a pixel does not look at it."""
    rays = viewing_rays(intrinsics, pose)
    eye = np.asarray(pose.position, dtype=np.float32)
    depth = np.zeros(rays.shape[1:], dtype=np.float32)
    below = np.flatnonzero((rays[2] < 0.0).any(axis=1))
    if below.size:
        # Above the horizon there is nothing to compute.
        part = slice(below[0], below[-1] + 1)
        x, y, fall = rays[:, part]
        reach = np.divide(-eye[2], fall, where=fall < 0.0, out=np.zeros_like(fall))
        half = np.float32(TABLE_EDGE_M / 2.0)
        on_it = (np.abs(eye[0] + reach * x) <= half) & (np.abs(eye[1] + reach * y) <= half)
        np.copyto(depth[part], reach, where=on_it)
    return depth


def table_colors(light: Light) -> tuple[Float, Float]:
    """Colours (3,) of the table, 0 to 255, in full light and in shadow."""
    rise = light.direction[2] / float(np.linalg.norm(light.direction))
    directed = (light.diffuse * rise + light.specular * rise**2) * np.asarray(light.color)
    plain = 255.0 * np.asarray(TABLE_COLOR)
    return plain * (light.ambient + directed), plain * (light.ambient + _IN_SHADOW * directed)


def cast_shadows(parts: Iterable[Float], light: Light, intrinsics: Intrinsics, pose: Pose) -> Mask:
    """How much of every pixel (H, W) lies in a shadow on the table, 0 to 255.

    Args:
        parts: Corners (V, 3) of the convex parts of all things, in the world.
        light: Where the lamp is.
        intrinsics: Of the camera.
        pose: Of the camera.
    """
    mask = np.zeros((intrinsics.height, intrinsics.width), dtype=np.uint8)
    slope = np.asarray(light.direction[:2]) / light.direction[2]
    inverse = np.linalg.inv(pose.matrix())
    for corners in parts:
        # Where the lamp's rays through the corners meet the table, as the camera sees it.
        ground = corners[:, :2] - corners[:, 2:] * slope
        x, y, z = inverse[:3, :2] @ ground.T + inverse[:3, 3:]
        z = np.maximum(z, _NEAREST_M)
        pixels = np.stack(
            [intrinsics.fx * x / z + intrinsics.cx, intrinsics.fy * y / z + intrinsics.cy], axis=1
        )
        fixed = np.rint(np.clip(pixels, -_FARTHEST, _FARTHEST) * (1 << _BITS)).astype(np.int32)
        cv2.fillConvexPoly(mask, cv2.convexHull(fixed), 255, cv2.LINE_AA, _BITS)
    return mask


# Shadows keep this share of the light that has a direction, as in the renderer's own model.
_IN_SHADOW = 0.8
_NEAREST_M = 0.02
# Pixels are drawn in fixed point; what is so far outside the image only needs its direction.
_FARTHEST = 10000.0
_BITS = 4
