"""Draws scenes in which every relation occurs: for experiments on the grounding of prepositions.

A scene has three groups: a stack of two; an object in an open container, or two objects pushed
together; and an object alone. The second group stands near the first one. So does the object
alone in half of the scenes; in the others it stands about one metre away.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Float
from ros_scenesense.scene import Size, Surface
from ros_scenesense.simulation.arrangements import Arrangement, Layout, Piece, draw_item
from ros_scenesense.simulation.catalogue import Catalogue, CatalogueItem
from ros_scenesense.simulation.object_files import Color


def draw_relations(
    catalogue: Catalogue, colors: Sequence[Color], view_yaw_rad: float, rng: np.random.Generator
) -> Layout:
    """Draws a layout of five pieces.

    Args:
        catalogue: What to draw from.
        colors: Five colours, in the order in which they are used.
        view_yaw_rad: Direction in which the viewer will look, about up.
        rng: Source of all randomness.

    Raises:
        SimulationError: If the catalogue has no open container into which something fits.
    """
    far = rng.random() < _FAR_SHARE
    # From as far away as such scenes ask for, something small is hardly seen.
    size = _FAR_SIZES[int(rng.integers(len(_FAR_SIZES)))] if far else None
    together = rng.random() < _TOGETHER_SHARE
    draw_second = _draw_neighbours if together else _draw_contained
    groups = [
        _draw_stack(catalogue, colors[0:2], rng),
        draw_second(catalogue, colors[2:4], rng),
        [_standing(draw_item(catalogue, colors[4], rng, size), colors[4], rng)],
    ]
    gaps = (rng.uniform(*_NEAR_M), rng.uniform(*(_FAR_M if far else _NEAR_M)))
    pieces: list[Piece] = []
    for group, gap in zip(groups, (0.0, *gaps), strict=True):
        first = len(pieces)
        moved = _beside(pieces, group, gap, view_yaw_rad, rng) if pieces else group
        pieces += [
            piece if piece.support is None else replace(piece, support=first + piece.support)
            for piece in moved
        ]
    return Layout(Arrangement.RELATIONS, _centred(pieces), ((3, 2),) if together else ())


_TOGETHER_SHARE = 0.35
_FAR_SHARE = 0.5
# Gaps between the circles about groups: near ones, and those on both sides of one metre.
_NEAR_M = (0.02, 0.20)
_FAR_M = (0.70, 1.25)
_FAR_SIZES = (Size.MEDIUM, Size.LARGE)
# A stack is to stand: the upper object is put this near to the middle of the lower one.
_OFFSET_M = 0.012
# Groups stand in front of, behind, or beside each other, this far off the axis, evenly drawn.
_OFF_AXIS_RAD = math.radians(25.0)
# So much of the height of what is in a container is below its rim.
_INSIDE_SHARE = 0.8
# Clear of the walls, also when small displacements test its stability.
_CLEAR_M = 0.004
# What is lower than this share of its container would be hidden in it.
_SEEN_SHARE = 0.5
# Between the circles about two objects before one is pushed towards the other.
_BEFORE_PUSH_M = 0.01


def _draw_stack(
    catalogue: Catalogue, colors: Sequence[Color], rng: np.random.Generator
) -> list[Piece]:
    lower = draw_item(catalogue, colors[0], rng, surface=Surface.FLAT, steady=True)
    sizes = [size for size in Size if size is not Size.LARGE or lower.size is Size.LARGE]
    upper = draw_item(catalogue, colors[1], rng, sizes[int(rng.integers(len(sizes)))])
    offset, angle = _OFFSET_M * math.sqrt(rng.random()), _yaw(rng)
    place = (offset * math.cos(angle), offset * math.sin(angle), _yaw(rng))
    return [_standing(lower, colors[0], rng), Piece(upper, colors[1], *place, support=0)]


def _draw_contained(
    catalogue: Catalogue, colors: Sequence[Color], rng: np.random.Generator
) -> list[Piece]:
    containers = [item for item in catalogue.values() if item.is_open and colors[0] in item.colors]
    for number in rng.permutation(len(containers)):
        outer = _standing(containers[number], colors[0], rng)
        choice = _fitting(catalogue, outer.item, colors[1])
        if not choice:
            continue
        item, places = choice[int(rng.integers(len(choice)))]
        x, y = places[int(rng.integers(len(places)))].tolist()
        cosine, sine = math.cos(outer.yaw_rad), math.sin(outer.yaw_rad)
        place = (x * cosine - y * sine, x * sine + y * cosine, _yaw(rng))
        return [outer, Piece(item, colors[1], *place, support=0)]
    raise SimulationError(
        f"no open {colors[0]} object has room for a {colors[1]} one: the shipped open box and tray "
        "have, give objects of your own other names"
    )


def _fitting(
    catalogue: Catalogue, container: CatalogueItem, color: Color
) -> list[tuple[CatalogueItem, Float]]:
    """What of a colour can be put into a container, and at which places (N, 2) from its centre."""
    room = catalogue.room(container)
    choice = []
    for item in catalogue.values():
        seen = item.height_m >= _SEEN_SHARE * container.height_m
        if color in item.colors and not item.is_open and seen:
            depth_m = _INSIDE_SHARE * item.height_m
            places = room.fitting(item.radius_m + _CLEAR_M, depth_m)
            if len(places):
                choice.append((item, places))
    return choice


def _draw_neighbours(
    catalogue: Catalogue, colors: Sequence[Color], rng: np.random.Generator
) -> list[Piece]:
    one, other = (_standing(draw_item(catalogue, color, rng), color, rng) for color in colors)
    distance, angle = one.item.radius_m + other.item.radius_m + _BEFORE_PUSH_M, _yaw(rng)
    x, y = distance * math.cos(angle), distance * math.sin(angle)
    return [one, replace(other, x_m=x, y_m=y)]


def _standing(item: CatalogueItem, color: Color, rng: np.random.Generator) -> Piece:
    return Piece(item, color, 0.0, 0.0, _yaw(rng))


def _beside(
    placed: Sequence[Piece],
    group: Sequence[Piece],
    gap_m: float,
    view_yaw_rad: float,
    rng: np.random.Generator,
) -> list[Piece]:
    """The group, moved so that its circle is this far from the circles of all that is there."""
    quarter = math.pi / 2.0 * float(rng.integers(4))
    angle = view_yaw_rad + quarter + float(rng.uniform(-_OFF_AXIS_RAD, _OFF_AXIS_RAD))
    x, y = math.cos(angle), math.sin(angle)
    reach = max(_reach(piece, other, gap_m, (x, y)) for piece in group for other in placed)
    return [replace(p, x_m=p.x_m + reach * x, y_m=p.y_m + reach * y) for p in group]


def _reach(piece: Piece, other: Piece, gap_m: float, way: tuple[float, float]) -> float:
    """How far along a unit way a piece must go until it is this far from the other."""
    x, y = piece.x_m - other.x_m, piece.y_m - other.y_m
    distance = piece.item.radius_m + other.item.radius_m + gap_m
    along = x * way[0] + y * way[1]
    across = x * way[1] - y * way[0]
    return math.sqrt(max(0.0, distance**2 - across**2)) - along


def _centred(pieces: Sequence[Piece]) -> tuple[Piece, ...]:
    """Moved to the middle of the table."""
    x, y = (
        (min(values) + max(values)) / 2.0
        for values in ([piece.x_m for piece in pieces], [piece.y_m for piece in pieces])
    )
    return tuple(replace(piece, x_m=piece.x_m - x, y_m=piece.y_m - y) for piece in pieces)


def _yaw(rng: np.random.Generator) -> float:
    return float(rng.uniform(-math.pi, math.pi))
