"""Shared value types: the relation vocabulary, attributes, decisions, structures and RGB-D frames.

Relations follow the paper (section *Grounding of Spatial Relations*): seven position-based and
three distance-based prepositions; the last argument of a relation is the reference object.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Intrinsics, Pose


class Position(StrEnum):
    """Position-based prepositions: where an object is, seen from the reference object."""

    IN = "in"
    ABOVE = "above"
    BELOW = "below"
    FRONT = "front"
    BEHIND = "behind"
    RIGHT = "right"
    LEFT = "left"

    @property
    def converse(self) -> Position | None:
        """The relation of the reference to the object; `in` has none in the vocabulary."""
        return _CONVERSE.get(self)


_CONVERSE = {
    Position.ABOVE: Position.BELOW,
    Position.BELOW: Position.ABOVE,
    Position.FRONT: Position.BEHIND,
    Position.BEHIND: Position.FRONT,
    Position.RIGHT: Position.LEFT,
    Position.LEFT: Position.RIGHT,
}


class Distance(StrEnum):
    """Distance-based prepositions (paper, equation of the distance heuristics); symmetric."""

    TOUCHING = "touching"
    NOT_TOUCHING = "not_touching"
    FAR = "far"


class NamingFrame(StrEnum):
    """The gravity-up frame in which left, right, front and behind are named.

    `viewer`: in front = nearer the camera. `robot`: fixed while the camera moves.
    `camera`: the tilted optical axes themselves, kept for comparison with the paper.
    """

    VIEWER = "viewer"
    ROBOT = "robot"
    CAMERA = "camera"


class Size(StrEnum):
    """Size class of an object, by the catalogue."""

    SMALL = "small"
    MEDIUM = "medium"
    LARGE = "large"


class Surface(StrEnum):
    """Top surface: flat if and only if a centred cube put on the object stays there."""

    FLAT = "flat"
    IRREGULAR = "irregular"


class Task(StrEnum):
    """The two estimation tasks of the paper."""

    STABILITY = "stability"
    OCCLUSION = "occlusion"


class Truth(StrEnum):
    """A label. Ambiguous ones are kept out of training and of the main figures."""

    TRUE = "true"
    FALSE = "false"
    AMBIGUOUS = "ambiguous"


class DecisionStatus(StrEnum):
    """How reasoning came to its decision about one literal."""

    STRICT = "strict"
    BY_DEFAULT = "by_default"
    UNDECIDED = "undecided"
    INCONSISTENT = "inconsistent"
    TIMED_OUT = "timed_out"


def find_structures(
    names: Iterable[str], supports: Iterable[tuple[str, str]]
) -> list[tuple[str, ...]]:
    """Group objects into structures: maximal stacks, each as its sorted members.

    A single object that stands on nothing and carries nothing is a structure of one member.

    Args:
        names: All objects of the scene.
        supports: Pairs (upper, lower) of the relation *on*; pairs with unknown names are ignored.

    Returns:
        The structures, sorted, each a sorted tuple of names.
    """
    parent = {name: name for name in names}

    def root(name: str) -> str:
        while parent[name] != name:
            parent[name] = parent[parent[name]]
            name = parent[name]
        return name

    for upper, lower in supports:
        if upper in parent and lower in parent:
            parent[root(upper)] = root(lower)
    groups: dict[str, list[str]] = {}
    for name in parent:
        groups.setdefault(root(name), []).append(name)
    return sorted(tuple(sorted(members)) for members in groups.values())


def structure_truth(members: Iterable[str], stable: Mapping[str, bool | None]) -> bool | None:
    """Stability of a structure: unstable if one member is, stable only if all are known stable.

    Args:
        members: Names of the members.
        stable: Stability per object; a missing name or None means not known.

    Returns:
        True, False, or None where it is undecided.
    """
    values = [stable.get(name) for name in members]
    if any(value is False for value in values):
        return False
    return True if values and all(value is True for value in values) else None


@dataclass(frozen=True, eq=False)
class Frame:
    """One RGB-D image; only nodes know how it travels as `sensor_msgs`.

    Attributes:
        stamp_ns: Time of capture in nanoseconds; equal on all images of the frame.
        frame_id: Name of the camera optical frame (REP-103: z forward, x right, y down).
        color: (H, W, 3) uint8, RGB.
        depth: (H, W) float32, metres along the optical axis; 0 or NaN where nothing was read.
        intrinsics: Pinhole intrinsics of both images, pixels.
        instances: (H, W) uint16 instance ids, 0 = background; None where nobody segmented.
        camera_pose: Pose of the optical frame in the world; None where unknown.

    Raises:
        FrameError: If shapes or types do not fit together, or the camera is not calibrated.
    """

    stamp_ns: int
    frame_id: str
    color: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    intrinsics: Intrinsics
    instances: npt.NDArray[np.uint16] | None = None
    camera_pose: Pose | None = None

    def __post_init__(self) -> None:
        camera = self.intrinsics
        numbers = (camera.fx, camera.fy, camera.cx, camera.cy)
        finite = all(math.isfinite(number) for number in numbers)
        if not finite or min(camera.width, camera.height) < 1 or min(camera.fx, camera.fy) <= 0.0:
            raise FrameError(
                f"camera info says {camera.width}x{camera.height} pixels, focal lengths "
                f"{camera.fx:g} and {camera.fy:g}, centre ({camera.cx:g}, {camera.cy:g}): publish "
                "the camera info of a calibrated camera"
            )
        expected = (self.intrinsics.height, self.intrinsics.width)
        images: list[tuple[str, npt.NDArray[np.generic] | None, tuple[int, ...], type]] = [
            ("color", self.color, (*expected, 3), np.uint8),
            ("depth", self.depth, expected, np.float32),
            ("instances", self.instances, expected, np.uint16),
        ]
        for name, image, shape, dtype in images:
            if image is None:
                continue
            if image.shape != shape or image.dtype != dtype:
                raise FrameError(
                    f"{name} image is {image.dtype} {image.shape}, but the camera info asks for "
                    f"{np.dtype(dtype)} {shape}: publish colour, depth, instances and camera info "
                    "of one size"
                )
