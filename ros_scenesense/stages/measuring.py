"""Attributes of the objects of a scene: those that somebody gave, else what is measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ros_scenesense.grounding.frames import NamingAxes, gravity_axes
from ros_scenesense.messages.scenes import KnownObject
from ros_scenesense.perception.attributes import Attributes, measure_attributes
from ros_scenesense.perception.clouds import ObjectCloud
from ros_scenesense.perception.colors import name_color
from ros_scenesense.perception.views import hidden_shares
from ros_scenesense.scene import Frame, NamingFrame
from ros_scenesense.stages.scene_objects import Measured

# An object is seen as a whole if no more of its outline than this is hidden or cut off.
_LARGEST_HIDDEN_SHARE = 0.12


def measured_attributes(
    frame: Frame,
    instances: npt.NDArray[np.uint16],
    known: Sequence[KnownObject],
    clouds: Sequence[ObjectCloud],
    axes: NamingAxes,
) -> list[Measured]:
    """What is measured of each object, in their order; nothing of one of which all is given.

    Args:
        frame: The images.
        instances: (H, W) instance ids.
        known: The objects as the scene has them.
        clouds: Their points in the optical frame; empty for those that are not located.
        axes: Of the naming frame. Without gravity only colours can be told.
    """
    if all(_is_complete(one) for one in known):
        return [Measured()] * len(known)
    hidden = hidden_shares(instances, frame.depth)
    upright = None if axes.name is NamingFrame.CAMERA else gravity_axes(axes.rows[2]).rows
    pixels = frame.color.reshape(-1, 3)
    found = []
    for one, cloud in zip(known, clouds, strict=True):
        if _is_complete(one) or len(cloud.points) == 0:
            found.append(Measured())
            continue
        attributes = Attributes()
        if upright is not None:
            whole = float(hidden[one.instance]) <= _LARGEST_HIDDEN_SHARE
            attributes = measure_attributes(cloud.points @ upright.T, whole)
        color = name_color(pixels[cloud.pixels])
        found.append(Measured(attributes.size, attributes.surface, attributes.shape, color))
    return found


def _is_complete(known: KnownObject) -> bool:
    return None not in (known.size, known.surface, known.shape, known.color)
