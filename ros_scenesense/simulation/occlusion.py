"""Occlusion labels: how much of what an object could show is hidden by others.

The paper calls an object occluded if some of its *frontal face* is hidden by another object. What
an object carries covers its top, not its front, and is therefore not counted as hiding it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Pose
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.arrangements import Layout

if TYPE_CHECKING:
    from ros_scenesense.simulation.camera import Camera
    from ros_scenesense.simulation.world import World

OCCLUDED_BELOW = 0.90
NOT_OCCLUDED_FROM = 0.97


def visible_fractions(
    world: World, camera: Camera, pose: Pose, layout: Layout, bodies: npt.NDArray[np.int32]
) -> list[float | None]:
    """The visible share of every piece of the layout.

    Args:
        world: The world as built; left as built.
        camera: Takes the pictures.
        pose: Of the camera.
        layout: What stands in the world.
        bodies: (H, W) Bullet ids as seen from the pose.

    Returns:
        Visible pixels / pixels that would be visible if only the object and what it carries,
        directly or not, were there. None if it would not be in the image even then.
    """
    fractions: list[float | None] = []
    for body, load in zip(world.bodies, _loads(layout), strict=True):
        world.show_only(load)
        unhidden = camera.bodies(pose) == body.id
        seen = (bodies == body.id)[unhidden]
        fractions.append(float(np.mean(seen)) if seen.size else None)
    world.reset()
    return fractions


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
