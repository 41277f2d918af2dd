"""The simulated RGB-D camera: colour, depth and the bodies that it sees.

Rendered by Bullet's software renderer (TinyRenderer), which needs no display and gives the same
image everywhere. Colour, depth and instance ids come from one pass, so they fit exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pybullet

from ros_scenesense.geometry import Intrinsics, Pose
from ros_scenesense.simulation.backgrounds import WALL_COLOR
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
        self._projection = pybullet.computeProjectionMatrixFOV(
            math.degrees(2.0 * math.atan(intrinsics.height / 2.0 / intrinsics.fy)),
            intrinsics.width / intrinsics.height,
            NEAR_M,
            FAR_M,
        )

    def picture(self, pose: Pose, light: Light) -> Picture:
        """Takes a picture of everything as it stands now."""
        _, _, color, depth, bodies = pybullet.getCameraImage(
            **self._view(pose),
            shadow=int(self._shadows),
            lightDirection=light.direction,
            lightColor=light.color,
            lightDistance=_LAMP_DISTANCE_M,
            lightAmbientCoeff=light.ambient,
            lightDiffuseCoeff=light.diffuse,
            lightSpecularCoeff=0.05,
        )
        shape = (self._intrinsics.height, self._intrinsics.width)
        rgb = np.array(_flat(color, np.uint8).reshape(*shape, 4)[..., :3])
        ids = _flat(bodies, np.int32).reshape(shape)
        buffer = _flat(depth, np.float32).reshape(shape).astype(np.float64)
        metres = FAR_M * NEAR_M / (FAR_M - (FAR_M - NEAR_M) * buffer)
        nothing = ids < 0
        metres[nothing] = 0.0
        rgb[nothing] = np.round(np.array(WALL_COLOR) * 255.0).astype(np.uint8)
        return Picture(rgb, metres.astype(np.float32), ids)

    def bodies(self, pose: Pose, scale: int = 1) -> npt.NDArray[np.int32]:
        """Bullet ids of the bodies as they stand now, (H, W); -1 where there is nothing.

        Args:
            pose: Of the optical frame in the world.
            scale: An image so many times smaller in both directions is enough.
        """
        image = pybullet.getCameraImage(**self._view(pose, scale), shadow=0)
        height, width = self._intrinsics.height // scale, self._intrinsics.width // scale
        return _flat(image[4], np.int32).reshape(height, width)

    def _view(self, pose: Pose, scale: int = 1) -> dict[str, object]:
        matrix = pose.matrix()
        eye, forward, up = matrix[:3, 3], matrix[:3, 2], -matrix[:3, 1]
        return {
            "width": self._intrinsics.width // scale,
            "height": self._intrinsics.height // scale,
            "viewMatrix": pybullet.computeViewMatrix(eye, eye + forward, up),
            "projectionMatrix": self._projection,
            "renderer": pybullet.ER_TINY_RENDERER,
            "physicsClientId": self._world.client,
        }


# Nearer, the shadow map ends on the table, farther it is too coarse for small objects.
_LAMP_DISTANCE_M = 3.0


def _flat(pixels: Any, dtype: type[np.generic]) -> npt.NDArray[Any]:
    if isinstance(pixels, np.ndarray):
        return pixels.astype(dtype, copy=False).ravel()
    # Bullet built without numpy hands out flat tuples; these are the fastest ways in.
    if dtype is np.uint8:
        return np.frombuffer(bytes(pixels), dtype)
    return np.fromiter(pixels, dtype, count=len(pixels))
