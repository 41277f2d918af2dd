"""Who touches whom, and who stands on whom, in the world as it is now."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pybullet

from ros_scenesense.simulation.arrangements import Layout
from ros_scenesense.simulation.world import World

# Bodies that are at rest on each other keep a gap, or an overlap, of some tenths of a millimetre.
TOUCHING_M = 0.002
# What is touched from above stands on it; what is touched from the side only leans.
_UPWARD = 0.5
# Bullet's boxes about bodies have a margin.
_STANDING_M = 0.005

Pairs = list[tuple[str, str]]


def touching(world: World) -> Pairs:
    """Pairs of names of bodies that touch: which of the two stands on the other is not said."""
    return [(one, other) for one, other, _ in _contacts(world)]


def supports(world: World) -> Pairs:
    """Pairs (upper, lower) of names: what stands on what, by the direction of the contacts."""
    pairs = []
    for one, other, upward in _contacts(world):
        if abs(upward) > _UPWARD:
            pairs.append((one, other) if upward > 0.0 else (other, one))
    return pairs


def misplaced(world: World, layout: Layout) -> str:
    """What does not stand, as built, where the layout says, in words; empty if all does."""
    pairs = {frozenset(pair) for pair in touching(world)}
    lowest = world.corners().reshape(len(world.bodies), 8, 3)[..., 2].min(axis=1)
    for piece, height in zip(layout.pieces, lowest, strict=True):
        if piece.support is None and height > _STANDING_M:
            return (
                f"{piece.name} does not come down to the table, something is in its way: move it "
                "with x_m and y_m, or say what it stands_on"
            )
        support = piece.name if piece.support is None else layout.pieces[piece.support].name
        if piece.support is not None and frozenset((piece.name, support)) not in pairs:
            return f"{piece.name} does not touch {support}, on which it should stand: move it"
    return ""


def bottom_up(names: Sequence[str], pairs: Pairs) -> list[str]:
    """The names in an order in which supports come before what they carry."""
    ordered: dict[str, None] = {}
    begun: set[str] = set()

    def visit(name: str) -> None:
        # Three bodies that lean on each other in a circle must not send this round for ever.
        if name in begun:
            return
        begun.add(name)
        for upper, lower in pairs:
            if upper == name:
                visit(lower)
        ordered[name] = None

    for name in names:
        visit(name)
    return list(ordered)


def _contacts(world: World) -> list[tuple[str, str, float]]:
    """Pairs of names with the mean upward part of the contact normals, towards the first."""
    found = []
    for one, other in itertools.combinations(world.bodies, 2):
        points = pybullet.getClosestPoints(
            one.id, other.id, TOUCHING_M, physicsClientId=world.client
        )
        if points:
            upward = float(np.mean([point[7][2] for point in points]))
            found.append((one.piece.name, other.piece.name, upward))
    return found
