"""From where, and in which light, a scene is seen: drawn so that every object is in the image."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import (
    Intrinsics,
    Pose,
    Vector,
    look_at,
    pose_of,
    transform_points,
)


@dataclass(frozen=True)
class Light:
    """Light of a scene: direction to the lamp; shares of ambient, diffuse, mirrored light; tint."""

    direction: Vector
    ambient: float
    diffuse: float
    color: Vector = (1.0, 1.0, 1.0)
    specular: float = 0.05


EVEN_LIGHT = Light(direction=(-0.5, 0.1, 0.86), ambient=0.5, diffuse=0.45)
"""A lamp behind and above the viewer, as scenes have it in the middle."""


def draw_light(rng: np.random.Generator) -> Light:
    """A lamp high on the camera's side of the scene, as a room has it; warmer or colder."""
    azimuth = rng.uniform(math.radians(85.0), math.radians(275.0))
    elevation = rng.uniform(math.radians(40.0), math.radians(75.0))
    direction = (
        math.cos(elevation) * math.cos(azimuth),
        math.cos(elevation) * math.sin(azimuth),
        math.sin(elevation),
    )
    ambient, diffuse = float(rng.uniform(0.42, 0.6)), float(rng.uniform(0.35, 0.55))
    warmth = float(rng.uniform(-_WARMEST, _WARMEST))
    return Light(direction, ambient, diffuse, (1.0 + warmth, 1.0, 1.0 - warmth))


def renderer_intrinsics(width: int, height: int, field_of_view_deg: float) -> Intrinsics:
    """Intrinsics of an image of the renderer with this vertical field of view.

    Its pixel centres lie on the image's middle column, but one row above the middle row: found by
    comparing its depth with known planes.
    """
    focal = height / 2.0 / math.tan(math.radians(field_of_view_deg) / 2.0)
    return Intrinsics(width, height, focal, focal, width / 2.0, height / 2.0 - 1.0)


def frame_scene(
    corners: npt.NDArray[np.floating],
    intrinsics: Intrinsics,
    pitch_rad: float,
    yaw_rad: float,
    distance_factor: float,
    roll_rad: float = 0.0,
) -> Pose:
    """Pose of a camera that has everything in the image.

    Args:
        corners: (N, 3) points in the world, metres, that must be in the image.
        intrinsics: Of the camera.
        pitch_rad: How far it looks down.
        yaw_rad: Direction it looks in, about up; 0 = along the world's x axis.
        distance_factor: 1 = as near as possible, 1.3 = 30 % farther away.
        roll_rad: How far it is turned clockwise about its optical axis.

    Returns:
        Pose of the optical frame in the world.
    """
    target = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    forward = np.array(
        [
            math.cos(pitch_rad) * math.cos(yaw_rad),
            math.cos(pitch_rad) * math.sin(yaw_rad),
            -math.sin(pitch_rad),
        ]
    )

    # The camera turns the same way from however far away it looks.
    eye = target - forward
    upright = look_at(_vector(eye), _vector(target))
    turned = pose_of(upright.matrix() @ _about_axis(roll_rad)) if roll_rad else upright
    right, down, depth = transform_points(np.linalg.inv(turned.matrix()), corners).T
    tangent_x = _FILL * intrinsics.width / 2.0 / intrinsics.fx
    tangent_y = _FILL * intrinsics.height / 2.0 / intrinsics.fy
    # Seen from the distance 1 + d a corner has the depth `depth + d`.
    farther = np.maximum(np.abs(right) / tangent_x, np.abs(down) / tangent_y) - depth
    nearest = max(1.0 + float(farther.max()), _NEAREST_M)
    return Pose(_vector(target - distance_factor * nearest * forward), turned.orientation)


# The nearest camera leaves a margin about the objects, and does not come closer than a sensor may.
_FILL = 0.92
_NEAREST_M = 0.35
# By so much red is stronger than green, and blue weaker, in the warmest light.
_WARMEST = 0.07


def _vector(values: npt.NDArray[np.float64]) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _about_axis(angle_rad: float) -> npt.NDArray[np.float64]:
    """Transform (4, 4) that turns the optical frame clockwise about its axis."""
    turn = np.eye(4)
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    turn[:2, :2] = [[cosine, -sine], [sine, cosine]]
    return turn
