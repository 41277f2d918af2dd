"""Frames of boxes on a table, rendered exactly, so that every relation is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Intrinsics, Pose, look_at, transform_points
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.scenes import KnownObject, Scene
from ros_scenesense.scene import Frame

INTRINSICS = Intrinsics(width=160, height=120, fx=165.0, fy=165.0, cx=80.0, cy=59.0)


@dataclass(frozen=True)
class Block:
    """An upright box: its name, the centre of its bottom in the world, its edge lengths."""

    name: str
    bottom: tuple[float, float, float]
    size: tuple[float, float, float] = (0.08, 0.08, 0.08)


def render(
    blocks: Sequence[Block],
    *,
    stamp_ns: int = 0,
    camera: Pose | None = None,
    table: bool = True,
    intrinsics: Intrinsics = INTRINSICS,
) -> Frame:
    """The frame of blocks on the table z = 0; instance ids 1 to n. The pose is not in the frame."""
    pose = camera or look_at((-0.8, 0.0, 0.45), (0.0, 0.0, 0.05))
    rays = intrinsics.rays().reshape(-1, 3)
    origin = np.asarray(pose.position)
    directions = transform_points(pose.matrix(), rays) - origin
    depth = np.full(len(rays), np.inf)
    instances = np.zeros(len(rays), dtype=np.uint16)
    with np.errstate(divide="ignore"):
        if table:
            hit = -origin[2] / directions[:, 2]
            depth = np.where(hit > 0.0, hit, np.inf)
        for number, block in enumerate(blocks, 1):
            hit = _hit(block, origin, directions)
            instances[hit < depth] = number
            depth = np.minimum(depth, hit)
    shape = (intrinsics.height, intrinsics.width)
    return Frame(
        stamp_ns=stamp_ns,
        frame_id="camera_color_optical_frame",
        color=np.full((*shape, 3), 128, dtype=np.uint8),
        depth=np.where(depth < 5.0, depth, 0.0).reshape(shape).astype(np.float32),
        intrinsics=intrinsics,
        instances=instances.reshape(shape),
    )


def scene_of(
    blocks: Sequence[Block],
    *,
    stamp_ns: int = 0,
    scene_id: str = "s-0000",
    pose: Pose | None = None,
) -> Scene:
    """The scene message that belongs to `render(blocks)`."""
    return Scene(
        stamp=Stamp.of(stamp_ns),
        scene_id=scene_id,
        mode="testing",
        objects=[
            KnownObject(instance=number, name=block.name) for number, block in enumerate(blocks, 1)
        ],
        camera_pose=pose,
    )


def _hit(block: Block, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Distance along each ray at which it enters the block; infinite where it misses."""
    half = np.asarray(block.size) / 2.0
    centre = np.asarray(block.bottom) + np.array([0.0, 0.0, half[2]])
    near = (centre - half - origin) / directions
    far = (centre + half - origin) / directions
    enter = np.minimum(near, far).max(axis=1)
    leave = np.maximum(near, far).min(axis=1)
    return np.where((enter <= leave) & (enter > 0.0), enter, np.inf)
