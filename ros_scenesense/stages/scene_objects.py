"""The objects of a scene: those that `scene` names and those that only the instance image shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Box
from ros_scenesense.messages.grounding import (
    AttributeSource,
    NameAttribute,
    PerceivedObject,
    SizeAttribute,
    SurfaceAttribute,
)
from ros_scenesense.messages.scenes import KnownObject, Scene
from ros_scenesense.scene import Size, Surface

LARGEST_INSTANCE = 65535


def fault_of(scene: Scene) -> str | None:
    """Why the objects of a scene cannot be told apart; None if they can."""
    instances: set[int] = set()
    names: set[str] = set()
    for one in scene.objects:
        if not 1 <= one.instance <= LARGEST_INSTANCE:
            return (
                f"'{one.name}' has instance id {one.instance}, must be from 1 to "
                f"{LARGEST_INSTANCE} (0 is the background)"
            )
        if one.instance in instances:
            return f"instance id {one.instance} is given twice, again to '{one.name}'"
        if one.name in names:
            return f"the name '{one.name}' is given twice"
        instances.add(one.instance)
        names.add(one.name)
    return None


def objects_of(instances: npt.NDArray[np.uint16], scene: Scene) -> list[KnownObject]:
    """All objects of a scene: as `scene` has them, then those of unnamed instance ids.

    An instance id that the scene does not name is called `object_<id>`, with underscores
    appended should that be the name of another object.
    """
    found = list(scene.objects)
    names = {one.name for one in found}
    unnamed = set(np.flatnonzero(np.bincount(instances.reshape(-1))).tolist())
    unnamed -= {0, *(one.instance for one in found)}
    for instance in sorted(unnamed):
        name = f"object_{instance}"
        while name in names:
            name += "_"
        found.append(KnownObject(instance=instance, name=name))
    return found


@dataclass(frozen=True)
class Measured:
    """What was measured of an object; None = it cannot be told.

    Attributes:
        size: Class of its size.
        surface: Whether its top is flat.
        shape: `box`, `cylinder`, `sphere` or `other`.
        color: Name of its colour.
    """

    size: Size | None = None
    surface: Surface | None = None
    shape: str | None = None
    color: str | None = None


def perceived(
    known: KnownObject, readings: int = 0, box: Box | None = None, measured: Measured | None = None
) -> PerceivedObject:
    """What is known of an object: its attributes, given before measured, and where it is.

    Args:
        known: The object as the scene has it.
        readings: How many of its pixels have a depth reading.
        box: Its box in the optical frame; None if it is not located.
        measured: What was measured of it.
    """
    found = measured or Measured()
    size, surface = known.size or found.size, known.surface or found.surface
    shape, color = known.shape or found.shape, known.color or found.color
    return PerceivedObject(
        instance=known.instance,
        name=known.name,
        points=readings,
        box=box,
        size=SizeAttribute(value=size, source=_source(known.size)) if size else None,
        surface=SurfaceAttribute(value=surface, source=_source(known.surface)) if surface else None,
        shape=NameAttribute(value=shape, source=_source(known.shape)) if shape else None,
        color=NameAttribute(value=color, source=_source(known.color)) if color else None,
    )


def _source(given: str | None) -> AttributeSource:
    return "given" if given else "measured"
