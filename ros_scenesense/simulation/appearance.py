"""How a scene looks besides its shapes: the textures of its objects and its background.

All of it is put on the rendered picture: geometry and labels cannot depend on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float, Pose, transform_points
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.backgrounds import PLAIN, recomposite
from ros_scenesense.simulation.textures import Pattern, Texture, draw_texture


@dataclass(frozen=True)
class Appearance:
    """The look of a scene.

    Attributes:
        textures: Of the objects, by name; who has none is plain.
        background: Its number.
    """

    textures: Mapping[str, Texture] = field(default_factory=dict)
    background: int = PLAIN


def draw_appearance(
    names: Sequence[str], textures: bool, backgrounds: int, rng: np.random.Generator
) -> Appearance:
    """Draws how a scene looks.

    Args:
        names: Of the objects.
        textures: Whether they have any.
        backgrounds: Number of different backgrounds; 0 = the plain one.
        rng: Source of all randomness.
    """
    number = int(rng.integers(1, backgrounds + 1)) if backgrounds else PLAIN
    return Appearance({name: draw_texture(rng) for name in names} if textures else {}, number)


def dress(frame: Frame, poses: Mapping[str, Pose], appearance: Appearance) -> Frame:
    """The frame, rendered plain, with textures and background.

    Args:
        frame: With camera pose and instance ids, 1 to n in the order of the poses.
        poses: Of the objects in the world, by name.
        appearance: What to put on.

    Raises:
        SimulationError: If the frame has no instance ids or no camera pose.
    """
    color = recomposite(frame, appearance.background).copy()
    assert frame.instances is not None
    pixels = color.reshape(-1, 3)
    shown = np.flatnonzero(frame.instances)
    owners = frame.instances.ravel()[shown]
    for number, (name, pose) in enumerate(poses.items(), 1):
        texture = appearance.textures.get(name)
        if texture is not None and texture.pattern is not Pattern.PLAIN:
            mine = shown[owners == number]
            brightness = texture.brightness(_in_frame_of(pose, frame, mine))
            pixels[mine] = np.rint(pixels[mine] * brightness[:, None]).astype(np.uint8)
    return replace(frame, color=color)


def _in_frame_of(pose: Pose, frame: Frame, pixels: npt.NDArray[np.intp]) -> Float:
    """Points (N, 3) in an object's own frame that the pixels, by flat index, show."""
    assert frame.camera_pose is not None
    rows, columns = np.divmod(pixels, frame.intrinsics.width)
    depth = frame.depth.ravel()[pixels].astype(np.float64)
    points = np.stack(
        [
            (columns - frame.intrinsics.cx) / frame.intrinsics.fx * depth,
            (rows - frame.intrinsics.cy) / frame.intrinsics.fy * depth,
            depth,
        ],
        axis=1,
    )
    return transform_points(np.linalg.inv(pose.matrix()) @ frame.camera_pose.matrix(), points)
