"""The simulated RGB-D camera: colour, depth and the bodies that it sees.

Rendered by Bullet's software renderer (TinyRenderer), which needs no display and gives the same
image everywhere; the table under the objects is computed. Colour, depth and instance ids come from
one pass, so they fit exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pybullet

from ros_scenesense.geometry import Float, Intrinsics, Pose, transform_points
from ros_scenesense.simulation.backgrounds import WALL_COLOR
from ros_scenesense.simulation.table import cast_shadows, table_colors, table_depth
from ros_scenesense.simulation.view import Light
from ros_scenesense.simulation.world import World

NEAR_M = 0.05
FAR_M = 8.0


@dataclass(frozen=True, eq=False)
class Picture:
    """What the camera sees.

    Attributes:
        color: (H, W, 3) uint8 RGB.
        depth: (H, W) float32 metres along the optical axis; 0 where there is nothing.
        bodies: (H, W) int32 Bullet ids of the bodies; -1 where there is nothing.
    """

    color: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    bodies: npt.NDArray[np.int32]


@dataclass(frozen=True)
class Window:
    """A part of an image: columns from `left` to before `right`, rows from `top` to `bottom`."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def part(self) -> tuple[slice, slice]:
        """Rows and columns, to take it out of an image."""
        return slice(self.top, self.bottom), slice(self.left, self.right)


class Camera:
    """Renders the bodies of a world, each in its one colour, before the plain background.

    Args:
        world: What it looks at.
        intrinsics: As `renderer_intrinsics` gives them.
        shadows: Whether objects cast shadows.
    """

    def __init__(self, world: World, intrinsics: Intrinsics, shadows: bool) -> None:
        self._world = world
        self._intrinsics = intrinsics
        self._shadows = shadows
        self._whole = Window(0, 0, intrinsics.width, intrinsics.height)

    def picture(self, pose: Pose, light: Light) -> Picture:
        """Takes a picture of everything as it stands now."""
        # The renderer's shadows want a whole picture: their map has its projection.
        _, _, color, depth, bodies = pybullet.getCameraImage(
            **self._view(pose, self._whole),
            shadow=int(self._shadows),
            lightDirection=light.direction,
            lightColor=light.color,
            lightDistance=_LAMP_DISTANCE_M,
            lightAmbientCoeff=light.ambient,
            lightDiffuseCoeff=light.diffuse,
            lightSpecularCoeff=light.specular,
        )
        shape = (self._intrinsics.height, self._intrinsics.width)
        ids = _flat(bodies, np.int32).reshape(shape)
        seen = ids >= 0
        metres = table_depth(self._intrinsics, pose)
        rgb = self._bare(pose, light, metres)
        buffer = _flat(depth, np.float32).reshape(shape)[seen].astype(np.float64)
        metres[seen] = FAR_M * NEAR_M / (FAR_M - (FAR_M - NEAR_M) * buffer)
        cv2.copyTo(
            cv2.cvtColor(_flat(color, np.uint8).reshape(*shape, 4), cv2.COLOR_RGBA2RGB),
            seen.astype(np.uint8),
            rgb,
        )
        return Picture(rgb, metres, ids)

    def bodies(
        self, pose: Pose, scale: int = 1, window: Window | None = None
    ) -> npt.NDArray[np.int32]:
        """Bullet ids of the bodies as they stand now, (H, W); -1 where there is nothing.

        Args:
            pose: Of the optical frame in the world.
            scale: An image so many times smaller in both directions is enough.
            window: The part of the image that is wanted; None = all.
        """
        view = self._view(pose, window or self._whole, scale)
        image = pybullet.getCameraImage(**view, shadow=0)
        return _flat(image[4], np.int32).reshape(view["height"], view["width"])

    def window(self, pose: Pose, points: Float) -> Window:
        """The part of the image in which points (N, 3) of the world lie, and a little about it."""
        local = transform_points(np.linalg.inv(pose.matrix()), points)
        if (local[:, 2] <= NEAR_M).any():
            return self._whole
        pixels = self._intrinsics.project(local)
        size = [self._intrinsics.width, self._intrinsics.height]
        # Of what is outside the image one pixel is left.
        low = np.clip(np.floor(pixels.min(axis=0)) - _MARGIN, 0, np.subtract(size, 1)).astype(int)
        high = np.clip(np.ceil(pixels.max(axis=0)) + _MARGIN + 1, low + 1, size).astype(int)
        return Window(*low.tolist(), *high.tolist())

    def _bare(
        self, pose: Pose, light: Light, table: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.uint8]:
        """Colour (H, W, 3) of the wall, and of the table with the shadows of everything on it."""
        lit, dark = table_colors(light)
        shades = np.rint(np.linspace(lit, dark, 256)).astype(np.uint8)
        shadow = np.zeros(table.shape, dtype=np.uint8)
        if self._shadows:
            shadow = cast_shadows(self._world.convex_parts(), light, self._intrinsics, pose)
        color = np.asarray(cv2.LUT(cv2.merge([shadow] * 3), shades[None]), dtype=np.uint8)
        color[table == 0.0] = _WALL
        return color

    def _view(self, pose: Pose, window: Window, scale: int = 1) -> dict[str, Any]:
        camera, matrix = self._intrinsics, pose.matrix()
        eye, forward, up = matrix[:3, 3], matrix[:3, 2], -matrix[:3, 1]
        projection = pybullet.computeProjectionMatrix(
            left=NEAR_M * (window.left - camera.width / 2.0) / camera.fx,
            right=NEAR_M * (window.right - camera.width / 2.0) / camera.fx,
            bottom=NEAR_M * (camera.height / 2.0 - window.bottom) / camera.fy,
            top=NEAR_M * (camera.height / 2.0 - window.top) / camera.fy,
            nearVal=NEAR_M,
            farVal=FAR_M,
        )
        return {
            "width": (window.right - window.left) // scale,
            "height": (window.bottom - window.top) // scale,
            "viewMatrix": pybullet.computeViewMatrix(eye, eye + forward, up),
            "projectionMatrix": projection,
            "renderer": pybullet.ER_TINY_RENDERER,
            "physicsClientId": self._world.client,
        }


# Nearer, the shadow map ends on the objects, farther it is too coarse for small objects.
_LAMP_DISTANCE_M = 3.0
_WALL = np.round(255.0 * np.array(WALL_COLOR)).astype(np.uint8)
# Pixels about a window: rounding must not cut off an edge.
_MARGIN = 2


def _flat(pixels: Any, dtype: type[np.generic]) -> npt.NDArray[Any]:
    if isinstance(pixels, np.ndarray):
        return pixels.astype(dtype, copy=False).ravel()
    # Bullet built without numpy hands out flat tuples; these are the fastest ways in.
    if dtype is np.uint8:
        return np.frombuffer(bytes(pixels), dtype)
    return np.fromiter(pixels, dtype, count=len(pixels))
