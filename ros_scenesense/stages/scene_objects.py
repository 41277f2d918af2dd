"""The objects of a scene: those that `scene` names and those that only the instance image shows."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Box
from ros_scenesense.messages.grounding import (
    NameAttribute,
    PerceivedObject,
    SizeAttribute,
    SurfaceAttribute,
)
from ros_scenesense.messages.scenes import KnownObject, Scene

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


def perceived(known: KnownObject, readings: int = 0, box: Box | None = None) -> PerceivedObject:
    """What is known of an object: the attributes that somebody gave, and where it is.

    Args:
        known: The object as the scene has it.
        readings: How many of its pixels have a depth reading.
        box: Its box in the optical frame; None if it is not located.
    """
    return PerceivedObject(
        instance=known.instance,
        name=known.name,
        points=readings,
        box=box,
        size=SizeAttribute(value=known.size, source="given") if known.size else None,
        surface=SurfaceAttribute(value=known.surface, source="given") if known.surface else None,
        shape=NameAttribute(value=known.shape, source="given") if known.shape else None,
        color=NameAttribute(value=known.color, source="given") if known.color else None,
    )
