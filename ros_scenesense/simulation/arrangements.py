"""Draws what stands where: the paper's towers, spread and intersection, and scenes for relations.

Source: section *Occlusion and Stability Estimation* of the paper's experimental set-up. A layout is
pure geometry on the table; the physics world finds the heights.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from ros_scenesense.scene import Size, Surface
from ros_scenesense.simulation.catalogue import Catalogue, CatalogueItem
from ros_scenesense.simulation.object_files import Color


class Arrangement(StrEnum):
    """How objects are arranged; `mixed` takes the first three in turn, scene by scene."""

    TOWERS = "towers"
    SPREAD = "spread"
    INTERSECTION = "intersection"
    RELATIONS = "relations"
    MIXED = "mixed"


@dataclass(frozen=True)
class Piece:
    """An object of a layout.

    Attributes:
        item: What it is.
        color: Its colour, unique in the layout.
        x_m: Forward coordinate of its centre of mass in the world.
        y_m: Left coordinate of its centre of mass in the world.
        yaw_rad: Its rotation about up.
        support: Index of the piece that it stands on; None for the table.
    """

    item: CatalogueItem
    color: Color
    x_m: float
    y_m: float
    yaw_rad: float
    support: int | None = None

    @property
    def name(self) -> str:
        """`<colour>_<shape>`."""
        return f"{self.color}_{self.item.shape}"


@dataclass(frozen=True)
class Layout:
    """The pieces of a scene, supports before what they carry.

    Attributes:
        arrangement: What was drawn, an `Arrangement`, or `written` if a person placed the pieces.
        pieces: What stands where.
        pushed: Pairs (one, other) of indices of pieces on the table: in the world the first is
            pushed towards the other until they touch.
    """

    arrangement: str
    pieces: tuple[Piece, ...]
    pushed: tuple[tuple[int, int], ...] = ()

    def supports(self) -> list[tuple[str, str]]:
        """Pairs (upper, lower) of names."""
        return [
            (piece.name, self.pieces[piece.support].name)
            for piece in self.pieces
            if piece.support is not None
        ]


def draw_layout(
    catalogue: Catalogue,
    arrangement: Arrangement,
    index: int,
    view_yaw_rad: float,
    rng: np.random.Generator,
    stacked: int | None = None,
) -> Layout:
    """Draws a layout.

    Args:
        catalogue: What to draw from.
        arrangement: What to draw.
        index: Number of the scene, which decides for `mixed`.
        view_yaw_rad: Direction in which the viewer will look, about up.
        rng: Source of all randomness.
        stacked: Number of objects in the stack of a tower or an intersection; None, or what
            cannot be, = any.
    """
    if arrangement is Arrangement.MIXED:
        arrangement = _IN_TURN[index % len(_IN_TURN)]
    colors = [list(Color)[i] for i in rng.permutation(len(Color))]
    if arrangement is Arrangement.RELATIONS:
        # It draws pieces of this module.
        from ros_scenesense.simulation.relation_layouts import draw_relations

        return draw_relations(catalogue, colors, view_yaw_rad, rng)
    alone = 0
    if arrangement is Arrangement.TOWERS:
        stacked = _stacked(stacked, len(colors), rng)
    elif arrangement is Arrangement.INTERSECTION:
        stacked = _stacked(stacked, len(colors) - 1, rng)
        alone = int(rng.integers(1, min(3, len(colors) - stacked) + 1))
    else:
        stacked, alone = 0, len(colors)
    structures = [_draw_stack(catalogue, colors[:stacked], rng)] if stacked else []
    for color in colors[stacked : stacked + alone]:
        item = draw_item(catalogue, color, rng)
        structures.append([Piece(item, color, 0.0, 0.0, _draw_yaw(rng))])
    return Layout(arrangement, _place(structures, view_yaw_rad, rng))


def draw_item(
    catalogue: Catalogue,
    color: Color,
    rng: np.random.Generator,
    size: Size | None = None,
    surface: Surface | None = None,
    steady: bool = False,
) -> CatalogueItem:
    """Draws an object that comes in a colour: first its size class, if that is not given.

    Shapes of one size or of few colours come up about as often as those of many.

    Args:
        catalogue: What to draw from.
        color: Colour that it will have.
        rng: Source of all randomness.
        size: Its size class, None = any.
        surface: None = any, else it must be able to carry something on this surface.
        steady: Whether it must keep standing when its load falls.
    """
    size = size or list(Size)[int(rng.integers(len(Size)))]
    choice = [
        item
        for item in catalogue.values()
        if color in item.colors
        and item.size is size
        and not item.relations_only
        and (surface is None or item.can_carry(size, surface))
        and (item.is_steady or not steady)
    ]
    sizes = Counter(item.shape for item in catalogue.values())
    weights = np.array([1.0 / (sizes[item.shape] * len(item.colors)) for item in choice])
    return choice[int(rng.choice(len(choice), p=weights / weights.sum()))]


def draw_offset(
    upper: CatalogueItem,
    lower: CatalogueItem,
    rng: np.random.Generator,
    most_m: float | None = None,
) -> tuple[float, float]:
    """Where an object is put relative to the middle of its support: (x, y) in metres.

    Args:
        upper: The object.
        lower: Its support.
        rng: Source of the offset.
        most_m: The largest offset; None = that of everything in the world.
    """
    limit = _LARGEST_OVERLAP_OFFSET * (upper.width_m + lower.width_m) / 2.0
    largest = _OFFSET_M if most_m is None else most_m
    offset = min(largest * math.sqrt(rng.random()), limit)
    direction = _draw_yaw(rng)
    return offset * math.cos(direction), offset * math.sin(direction)


_IN_TURN = (Arrangement.TOWERS, Arrangement.SPREAD, Arrangement.INTERSECTION)

# Of the objects that carry another one, this share is irregular. More would leave few stacks
# whose stability is a question of alignment.
_IRREGULAR_SUPPORT_SHARE = 0.10
# This share of stacks is sorted with the largest object at the bottom, as people stack.
_SORTED_SHARE = 0.6
# Alignment law: an object's centre of mass lies anywhere in a disc of this radius about that of
# its support. It is absolute, so the larger the base, the safer the stack.
_OFFSET_M = 0.043
# Yet the objects must overlap: at most this share of the sum of their half widths.
_LARGEST_OVERLAP_OFFSET = 0.75
# A structure is placed next to one that is there: this share in line with it and the viewer, the
# others beside it. Ranges of the gap between the two, and of how far it is out of line.
_IN_LINE_SHARE = 0.5
_GAP_IN_LINE_M = (0.02, 0.04)
_GAP_BESIDE_M = (0.02, 0.10)
_OUT_OF_LINE_M = 0.015
# Of two in line this share has the lower one behind, where much of it is hidden: else a pitcher
# behind a duck would make what is behind something often hardly occluded.
_LOWER_BEHIND_SHARE = 0.65
_LEAST_GAP_M = 0.02

_SIZE_RANK = {Size.LARGE: 0, Size.MEDIUM: 1, Size.SMALL: 2}


def _stacked(asked: int | None, most: int, rng: np.random.Generator) -> int:
    possible = range(2, most + 1)
    if asked is not None and asked in possible:
        return asked
    return int(rng.integers(possible.start, possible.stop))


def _draw_yaw(rng: np.random.Generator) -> float:
    return float(rng.uniform(-math.pi, math.pi))


def _draw_stack(
    catalogue: Catalogue, colors: Sequence[Color], rng: np.random.Generator
) -> list[Piece]:
    """A stack whose bottom stands at the origin; supports are indices into the stack."""
    sizes = [list(Size)[i] for i in rng.integers(len(Size), size=len(colors))]
    if rng.random() < _SORTED_SHARE:
        sizes.sort(key=_SIZE_RANK.__getitem__)
    items: list[CatalogueItem] = []
    for size, color in zip(sizes[:-1], colors[:-1], strict=True):
        irregular = rng.random() < _IRREGULAR_SUPPORT_SHARE
        surface = Surface.IRREGULAR if irregular else Surface.FLAT
        # A load that falls must not take the bottom along: that would be the bottom's own fall.
        # Nor may slender objects carry: of five, hardly a tower would stand.
        steady = not items or not irregular
        items.append(draw_item(catalogue, color, rng, size, surface, steady))
    items.append(draw_item(catalogue, colors[-1], rng, sizes[-1]))
    pieces: list[Piece] = []
    for item, color in zip(items, colors, strict=True):
        if not pieces:
            pieces.append(Piece(item, color, 0.0, 0.0, _draw_yaw(rng)))
            continue
        below = pieces[-1]
        x, y = draw_offset(item, below.item, rng)
        place = (below.x_m + x, below.y_m + y, _draw_yaw(rng))
        pieces.append(Piece(item, color, *place, len(pieces) - 1))
    return pieces


def _place(
    structures: Sequence[Sequence[Piece]], view_yaw_rad: float, rng: np.random.Generator
) -> tuple[Piece, ...]:
    """Moves the structures, each drawn at the origin, next to each other without touching."""
    placed: list[Piece] = []
    for structure in structures:
        moved = list(structure)
        while not all(_apart(piece, other) for piece in moved for other in placed):
            shift = _draw_neighbour(placed, structure[0], view_yaw_rad, rng)
            moved = [replace(p, x_m=p.x_m + shift[0], y_m=p.y_m + shift[1]) for p in structure]
        first = len(placed)
        placed.extend(
            replace(piece, support=None if piece.support is None else first + piece.support)
            for piece in moved
        )
    return tuple(placed)


def _draw_neighbour(
    placed: Sequence[Piece], piece: Piece, view_yaw_rad: float, rng: np.random.Generator
) -> tuple[float, float]:
    """A place next to one of those that stand on the table."""
    standing = [other for other in placed if other.support is None]
    anchor = standing[int(rng.integers(len(standing)))]
    in_line = rng.random() < _IN_LINE_SHARE
    gap = rng.uniform(*(_GAP_IN_LINE_M if in_line else _GAP_BESIDE_M))
    distance = anchor.item.radius_m + piece.item.radius_m + gap
    out_of_line = rng.uniform(-_OUT_OF_LINE_M, _OUT_OF_LINE_M)
    share = 0.5
    if in_line:
        lower = piece.item.height_m < anchor.item.height_m
        share = _LOWER_BEHIND_SHARE if lower else 1.0 - _LOWER_BEHIND_SHARE
    side = 1.0 if rng.random() < share else -1.0
    # Along the viewer's line of sight, then to its left.
    along, left = (side * distance, out_of_line) if in_line else (out_of_line, side * distance)
    cosine, sine = math.cos(view_yaw_rad), math.sin(view_yaw_rad)
    return (
        anchor.x_m + along * cosine - left * sine,
        anchor.y_m + along * sine + left * cosine,
    )


def _apart(piece: Piece, other: Piece) -> bool:
    distance = math.hypot(piece.x_m - other.x_m, piece.y_m - other.y_m)
    return distance >= piece.item.radius_m + other.item.radius_m + _LEAST_GAP_M
