"""How far what rests on an object leans over its edge: the geometry that pixels hardly tell.

A stack falls where the centre of mass of all that stands on some object lies beyond the area by
which it stands there. Masses are not known; they are taken to go with the volumes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from ros_scenesense.attention.footprint import Footprint

_SMALLEST = 1e-9


def overhangs(
    footprints: Mapping[str, Footprint],
    supports: Iterable[tuple[str, str]],
    irregular: Collection[str] = (),
) -> dict[str, float]:
    """The overhang of every object that stands on another.

    Of each object below it, directly or through others, it is asked how far the common centre of
    mass of all that the object carries lies beyond the area of contact, which is within the
    footprints of both that touch there; the worst counts.

    Args:
        footprints: By the names of the objects.
        supports: Pairs (upper, lower) of the relation *on*; pairs with unknown names are ignored.
        irregular: Objects with an irregular surface: what is on them touches them in a point.

    Returns:
        Metres by the names of the objects: positive beyond the edge, negative within it.
    """
    below: dict[str, set[str]] = {}
    for upper, lower in supports:
        if upper in footprints and lower in footprints and upper != lower:
            below.setdefault(upper, set()).add(lower)
    under = {name: _reached(name, below) - {name} for name in below}
    beyond = {}
    for lower in set().union(*under.values()):
        load = sorted(name for name, reached in under.items() if lower in reached)
        direct = [footprints[name] for name in load if lower in below[name]]
        beyond[lower] = _beyond(
            [footprints[name] for name in load], direct, footprints[lower], lower in irregular
        )
    return {name: max(beyond[lower] for lower in each) for name, each in under.items() if each}


def _reached(name: str, below: Mapping[str, set[str]]) -> set[str]:
    """All that is below an object; supports in a circle end the search."""
    reached: set[str] = set()
    waiting = [name]
    while waiting:
        fresh = below.get(waiting.pop(), set()) - reached
        reached |= fresh
        waiting += fresh
    return reached


def _beyond(
    load: Sequence[Footprint], direct: Sequence[Footprint], support: Footprint, point: bool
) -> float:
    """How far the load's centre of mass is outside of what it touches the support with."""
    volumes = np.array([max(each.area * each.height, _SMALLEST) for each in load])
    mass = np.average([each.middle for each in load], axis=0, weights=volumes)
    beyond = float(np.linalg.norm(mass - support.middle)) if point else support.beyond(mass)
    # Several stand firmer together than each of them does: then the support alone counts, as in
    # a circle of supports, where nothing rests directly on anything.
    return max([beyond, *(each.beyond(mass) for each in direct if len(direct) == 1)])
