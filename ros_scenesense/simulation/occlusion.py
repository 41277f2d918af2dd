"""Occlusion labels: how much of what an object could show is hidden by others.

The paper calls an object occluded if some of its *frontal face* is hidden by another object. What
an object carries covers its top, not its front, and is therefore not counted as hiding it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Pose
from ros_scenesense.messages.base import Name, Part, Probability
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.arrangements import Layout

if TYPE_CHECKING:
    from ros_scenesense.simulation.camera import Camera, Picture, Window
    from ros_scenesense.simulation.world import World

# What borders on something and is so much farther away is behind it.
_BEHIND_M = 0.02
OCCLUDED_BELOW = 0.90
NOT_OCCLUDED_FROM = 0.97


class Hiding(Part, frozen=True):
    """Who hides whom: the share of the pixels that `object` could show which are `by`'s."""

    object: Name
    by: Name
    share: Probability


@dataclass(frozen=True)
class Visibility:
    """How much of an object is seen.

    Attributes:
        fraction: Visible pixels / pixels that would be visible if only the object and what it
            carries, directly or not, were there. None if it would not be in the image even then.
        hidden: By whom the others are covered, the most first.
    """

    fraction: float | None
    hidden: tuple[Hiding, ...]


def visibilities(
    world: World, camera: Camera, pose: Pose, layout: Layout, picture: Picture
) -> list[Visibility]:
    """How much is seen of every piece of the layout.

    Args:
        world: The world as built; left as built.
        camera: Takes the pictures.
        pose: Of the camera.
        layout: What stands in the world.
        picture: What is seen from the pose.
    """
    names = {body.id: body.piece.name for body in world.bodies}
    corners = world.corners().reshape(-1, 8, 3)
    found = []
    for body, load in zip(world.bodies, _loads(layout), strict=True):
        carried = np.array([name in load for name in names.values()])
        window = camera.window(pose, corners[carried].reshape(-1, 3))
        mine = np.isin(picture.bodies[window.part], np.array(list(names))[carried])
        if not _may_be_hidden(picture, window, body.id, mine):
            found.append(Visibility(1.0, ()))
            continue
        world.show_only(load)
        # Where the whole picture shows nothing nothing hides: an edge was rounded otherwise.
        seen = picture.bodies[window.part]
        unhidden = (camera.bodies(pose, window=window) == body.id) & (seen >= 0)
        found.append(_visibility(body.id, seen[unhidden], names))
    world.reset()
    return found


def _may_be_hidden(
    picture: Picture, window: Window, body: int, mine: npt.NDArray[np.bool_]
) -> bool:
    """Whether something may hide a body: it is not seen at all, or a border says so.

    A body and what it carries touch, so what hides a part of them borders on what is seen of them,
    and there it is nearer.

    Args:
        picture: What is seen.
        window: In which the body and what it carries lie.
        body: Bullet's id.
        mine: (H, W) where in the window it or what it carries is seen.
    """
    bodies, depth = picture.bodies[window.part], picture.depth[window.part]
    if not np.any(bodies == body):
        return True
    reach = cv2.dilate(np.where(mine, depth, np.float32(0.0)), np.ones((3, 3), np.uint8))
    return bool(np.any((bodies >= 0) & ~mine & (reach > 0.0) & (depth < reach + _BEHIND_M)))


def _visibility(body: int, seen: npt.NDArray[np.int32], names: Mapping[int, str]) -> Visibility:
    """From the ids (N,) of what is seen where the body would be."""
    if not seen.size:
        return Visibility(None, ())
    shares = {
        int(other): count / seen.size
        for other, count in zip(*np.unique(seen, return_counts=True), strict=True)
    }
    fraction = float(shares.pop(body, 0.0))
    hidden = [
        Hiding(object=names[body], by=names[other], share=float(share))
        for other, share in shares.items()
        if other in names
    ]
    return Visibility(fraction, tuple(sorted(hidden, key=lambda one: (-one.share, one.by))))


def occlusion(visible_fraction: float | None) -> Truth:
    """TRUE below .90, FALSE from .97 on; between them lie rims and slivers: AMBIGUOUS.

    So is an object that is not in the image.
    """
    if visible_fraction is None:
        return Truth.AMBIGUOUS
    if visible_fraction < OCCLUDED_BELOW:
        return Truth.TRUE
    return Truth.FALSE if visible_fraction >= NOT_OCCLUDED_FROM else Truth.AMBIGUOUS


def _loads(layout: Layout) -> list[set[str]]:
    """For every piece the names of itself and of all that it carries."""
    loads: list[set[str]] = [{piece.name} for piece in layout.pieces]
    # Supports come before what they carry: from the top down every load is complete when used.
    for index in reversed(range(len(loads))):
        support = layout.pieces[index].support
        if support is not None:
            loads[support] |= loads[index]
    return loads
