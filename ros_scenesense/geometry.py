"""Projection, rigid transforms and boxes. Metres, radians, pixels; quaternions are (x, y, z, w).

World frame (REP-103): x forward, y left, z up. Camera optical frame: z forward, x right, y down.
"""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Length = Annotated[float, msgspec.Meta(ge=0.0)]


class Pose(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Position (metres) and orientation (unit quaternion x, y, z, w) of a frame in its parent.

    Raises:
        ValueError: If the quaternion's length is not 1 (within 0.001).
    """

    position: Vector
    orientation: Quaternion

    def __post_init__(self) -> None:
        length = math.hypot(*self.orientation)
        if not abs(length - 1.0) <= 1e-3:
            raise ValueError(f"orientation is a quaternion of length {length:.6g}, must be 1")

    def matrix(self) -> Float:
        """The (4, 4) homogeneous transform from this frame to its parent."""
        transform = np.eye(4)
        transform[:3, :3] = rotation_matrix(self.orientation)
        transform[:3, 3] = self.position
        return transform


class Intrinsics(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Pinhole camera without distortion; a pixel's integer coordinates are its centre.

    Pixel (column u, row v) looks along ((u - cx) / fx, (v - cy) / fy, 1) in the optical frame.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def rays(self) -> Float:
        """Viewing directions of all pixels with z = 1, (H, W, 3)."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        return np.stack(
            [(u - self.cx) / self.fx, (v - self.cy) / self.fy, np.ones(u.shape)], axis=-1
        )

    def back_project(self, depth: npt.NDArray[np.floating]) -> Float:
        """Points of all pixels in the optical frame, (H, W, 3) metres; NaN without a reading."""
        z = np.where(np.isfinite(depth) & (depth > 0.0), depth, np.nan).astype(np.float64)
        points = np.empty((*z.shape, 3))
        # One coordinate after the other: several times faster than rays() * z.
        np.multiply(z, (np.arange(self.width) - self.cx) / self.fx, out=points[..., 0])
        np.multiply(z, ((np.arange(self.height) - self.cy) / self.fy)[:, None], out=points[..., 1])
        points[..., 2] = z
        return points

    def project(self, points: npt.NDArray[np.floating]) -> Float:
        """Pixel coordinates (N, 2) of points (N, 3) in the optical frame; z must be positive."""
        points = np.asarray(points, dtype=np.float64)
        u = points[:, 0] / points[:, 2] * self.fx + self.cx
        v = points[:, 1] / points[:, 2] * self.fy + self.cy
        return np.stack([u, v], axis=-1)


class Box(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An oriented box: pose of its centre and its full edge lengths (metres)."""

    pose: Pose
    size: tuple[Length, Length, Length]

    def corners(self) -> Float:
        """The eight corners (8, 3) in the parent frame."""
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        local = signs * np.asarray(self.size) / 2.0
        return transform_points(self.pose.matrix(), local)


def rotation_matrix(quaternion: Quaternion) -> Float:
    """Rotation (3, 3) of a quaternion (x, y, z, w), normalised first."""
    x, y, z, w = np.asarray(quaternion, dtype=np.float64) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of(rotation: npt.NDArray[np.floating]) -> Quaternion:
    """Unit quaternion (x, y, z, w) with w >= 0 of a proper rotation matrix (3, 3)."""
    m = np.asarray(rotation, dtype=np.float64)
    # The eigenvector of the largest eigenvalue is the quaternion (Bar-Itzhack, 2000): no case
    # distinction, and it stays accurate for half turns.
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
            [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
            [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], 0],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)],
        ]
    )
    x, y, z, w = np.linalg.eigh(k / 3.0)[1][:, -1]
    sign = -1.0 if w < 0.0 else 1.0
    return (float(sign * x), float(sign * y), float(sign * z), float(sign * w))


def pose_of(matrix: npt.NDArray[np.floating]) -> Pose:
    """The pose of a (4, 4) homogeneous transform."""
    x, y, z = (float(value) for value in matrix[:3, 3])
    return Pose(position=(x, y, z), orientation=quaternion_of(matrix[:3, :3]))


def transform_points(matrix: npt.NDArray[np.floating], points: npt.NDArray[np.floating]) -> Float:
    """Points (..., 3) moved by a homogeneous transform (4, 4)."""
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3], dtype=np.float64)


def look_at(eye: Vector, target: Vector) -> Pose:
    """Pose in the world of an optical frame at `eye` that looks at `target`, image upright.

    Raises:
        ValueError: If the camera would look straight up or down, or `eye` equals `target`.
    """
    forward = np.asarray(target, dtype=np.float64) - np.asarray(eye, dtype=np.float64)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-9:
        raise ValueError(f"camera at {eye} looking at {target} has no upright image")
    forward /= np.linalg.norm(forward)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    matrix[:3, 3] = eye
    return pose_of(matrix)
