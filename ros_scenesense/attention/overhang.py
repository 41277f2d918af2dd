"""How far what rests on an object leans over its edge: the geometry that pixels hardly tell.

A stack falls where the centre of mass of all that stands on some object lies beyond the area by
which it stands there. Masses are not known; they are taken to go with the volumes of the boxes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Box, Float, rotation_matrix

LARGEST = 3.0
"""Overhangs are cut off here: beyond, all are the same."""
_SMALLEST_M = 1e-3


@dataclass(frozen=True)
class Overhang:
    """The worst overhang below an object, as a share of half the width of the area of contact.

    0 is centred, 1 on the edge. `lateral` is along the image, `away` along the line of sight, in
    which direction a camera sees little of an object: it is taken to be as deep as it is wide.
    """

    lateral: float
    away: float


def overhangs(
    boxes: Mapping[str, Box],
    supports: Iterable[tuple[str, str]],
    irregular: Collection[str] = (),
) -> dict[str, Overhang]:
    """The overhang of every object that stands on another.

    Of each object below it, directly or through others, it is asked how far the common centre of
    mass of all that the object carries lies from the middle of where that touches it; the largest
    share counts.

    Args:
        boxes: Boxes of the located objects by name; their axes are right, away, up in the optical
            frame, the same for all of them.
        supports: Pairs (upper, lower) of the relation *on*; pairs with unknown names are ignored.
        irregular: Objects with an irregular surface: what is on them touches them in a point.
    """
    shapes = {name: _shape(box) for name, box in boxes.items()}
    below: dict[str, set[str]] = {}
    for upper, lower in supports:
        if upper in shapes and lower in shapes and upper != lower:
            below.setdefault(upper, set()).add(lower)
    under = {name: _reached(name, below) - {name} for name in below}
    shares = {}
    for lower in set().union(*under.values()):
        load = [name for name, reached in under.items() if lower in reached]
        direct = [shapes[name] for name in load if lower in below[name]]
        width = 0.0 if lower in irregular else 1.0
        shares[lower] = _share([shapes[name] for name in load], direct, shapes[lower], width)
    return {
        name: Overhang(*(max(shares[lower][axis] for lower in reached) for axis in (0, 1)))
        for name, reached in under.items()
        if reached
    }


Shape = tuple[Float, Float]
"""Centre (3,) and half extents (3,) in metres along right, away, up."""


def _shape(box: Box) -> Shape:
    axes = rotation_matrix(box.pose.orientation)  # columns: right, away, up in the optical frame
    centre = axes.T @ np.asarray(box.pose.position)
    half = np.asarray(box.size) / 2.0
    # Only the front is seen: what is missing to a square lies behind it.
    missing = max(0.0, half[0] - half[1])
    unseen = np.array([0.0, missing, 0.0])
    return centre + unseen, half + unseen


def _reached(name: str, below: Mapping[str, set[str]]) -> set[str]:
    """All that is below an object; supports in a circle end the search."""
    reached: set[str] = set()
    waiting = [name]
    while waiting:
        fresh = below.get(waiting.pop(), set()) - reached
        reached |= fresh
        waiting += fresh
    return reached


def _share(
    load: Sequence[Shape], direct: Sequence[Shape], support: Shape, width: float
) -> tuple[float, float]:
    """Distance of the load's centre of mass from the middle of the contact, by its half width."""
    volumes = np.array([np.prod(np.maximum(half, _SMALLEST_M)) for _, half in load])
    mass = np.average([centre for centre, _ in load], axis=0, weights=volumes)
    centre, half = support
    # In a circle of supports nothing rests directly on anything: the whole support counts.
    lows = [np.maximum(centre - half, each - size) for each, size in direct] or [centre - half]
    highs = [np.minimum(centre + half, each + size) for each, size in direct] or [centre + half]
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    offset = np.abs(mass - (low + high) / 2.0)
    shares = offset / np.maximum((high - low) / 2.0 * width, _SMALLEST_M)
    return min(LARGEST, float(shares[0])), min(LARGEST, float(shares[1]))
