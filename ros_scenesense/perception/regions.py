"""Cuts what stands on the table into pieces that are surely of one object each.

A pixel graph: neighbours are joined unless there is a step in space, an edge of colour, or a
concave crease, as there is where two objects meet. What is left over (the creases themselves,
specks, pixels without a reading) is flooded from the pieces and from the table along colours.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy.ndimage import find_objects
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ros_scenesense.perception.surface import (
    LIGHTNESS_WEIGHT,
    Image,
    Labels,
    Mask,
    Surface,
    spread,
)


@dataclass(frozen=True, eq=False)
class Pieces:
    """The pieces of a part of an image.

    Attributes:
        labels: (h, w) from 1 to `count`; 0 = background.
        count: How many there are.
    """

    labels: Labels
    count: int


def cut(surface: Surface, rising: Mask, read: Mask, table: Mask) -> Pieces:
    """Cuts what rises from the table into pieces.

    Args:
        surface: Of the part of the image.
        rising: (h, w) pixels that are of something on the table.
        read: (h, w) pixels with a depth reading.
        table: (h, w) pixels whose reading is surely of no object, however near one they are.
    """
    solid = _closed(rising, read)
    seeds, count = _seeds(surface, solid)
    if count == 0:
        return Pieces(np.zeros(rising.shape, dtype=np.int32), 0)
    background = count + 1
    markers = seeds.copy()
    near = cv2.dilate(rising.view(np.uint8), _RING).view(np.bool_)
    markers[~rising & read & (~near | table)] = background
    markers[~(read | solid) & _far(rising, read | solid)] = background
    _let_in(markers, background, seeds, surface)
    for edge in (markers[0], markers[-1], markers[:, 0], markers[:, -1]):
        edge[edge == 0] = background
    cv2.watershed(_flooded(surface.lab), markers)
    labels = spread(np.maximum(markers, 0), markers > 0)
    return Pieces(np.where(labels == background, 0, labels).astype(np.int32), count)


# Neighbours farther apart in space are of two surfaces.
_GAP_M = 0.01
# Neighbours whose colours differ more are of two pieces: CIELAB, lightness weighted down.
_COLOR_STEP = 12.0
# What bends more is a concave crease.
_CREASE = -0.3
_LEAST_PIXELS = 40
# Holes as wide as this are closed in what rises.
_HOLE = np.ones((7, 7), dtype=np.uint8)
# So near an object even pixels that read as table may be its foot.
_RING = np.ones((13, 13), dtype=np.uint8)
_NEIGHBOURS = np.ones((3, 3), dtype=np.uint8)


def _closed(rising: Mask, read: Mask) -> Mask:
    """What rises, with the small holes in its readings."""
    closed = cv2.morphologyEx(rising.view(np.uint8), cv2.MORPH_CLOSE, _HOLE).view(np.bool_)
    return rising | (closed & ~read)


def _seeds(surface: Surface, solid: Mask) -> tuple[Labels, int]:
    """Connected pieces (h, w) of the pixel graph that are no specks, and their number."""
    node = solid & (surface.bend > _CREASE)
    index = np.arange(node.size, dtype=np.int32).reshape(node.shape)
    starts, ends = [], []
    for one, other in (
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:-1], np.s_[1:]),
    ):
        both = np.nonzero(node[one] & node[other])
        gap = surface.points[one][both] - surface.points[other][both]
        change = surface.lab[one][both] - surface.lab[other][both]
        joined = np.einsum("nc,nc->n", gap, gap) < _GAP_M**2
        joined &= np.einsum("nc,nc->n", change, change) < _COLOR_STEP**2
        starts.append(index[one][both][joined])
        ends.append(index[other][both][joined])
    first, second = np.concatenate(starts), np.concatenate(ends)
    graph = coo_matrix(
        (np.ones(len(first), dtype=np.bool_), (first, second)), shape=(node.size, node.size)
    )
    _, found = connected_components(graph, directed=False)
    component = np.where(node.ravel(), found + 1, 0)
    sizes = np.bincount(component)
    kept = sizes >= _LEAST_PIXELS
    kept[0] = False
    number = np.zeros(len(sizes), dtype=np.int32)
    number[kept] = np.arange(1, np.count_nonzero(kept) + 1)
    return number[component].reshape(node.shape), int(np.count_nonzero(kept))


def _far(rising: Mask, known: Mask) -> Mask:
    """Pixels (h, w) of which nothing is known and that are too far from what rises to be of it.

    A hole that reaches the edge of the part is the open space behind the table, or a wall.
    """
    distance = cv2.distanceTransform((~rising).view(np.uint8), cv2.DIST_L2, 3)
    _, holes = cv2.connectedComponents((~known).view(np.uint8), connectivity=8)
    limit = np.full(int(holes.max()) + 1, _FARTHEST_IN_HOLE, dtype=np.float32)
    edges = (holes[0], holes[-1], holes[:, 0], holes[:, -1])
    limit[np.unique(np.concatenate(edges))] = _FARTHEST_IN_OPEN
    return np.asarray(distance > limit[holes])


_FARTHEST_IN_HOLE = 25.0
_FARTHEST_IN_OPEN = 6.0


def _let_in(markers: Labels, background: int, seeds: Labels, surface: Surface) -> None:
    """Opens what lies about within the convex outline of a piece and is of its colour.

    The floor of a bowl or a tray is hardly higher than the table on which it stands.
    """
    outside = markers == background
    table = np.median(surface.lab[outside][:: max(1, outside.sum() // 2000)], axis=0)
    for label, (rows, columns) in enumerate(find_objects(seeds), 1):
        window = np.s_[
            max(0, rows.start - _BEYOND) : rows.stop + _BEYOND,
            max(0, columns.start - _BEYOND) : columns.stop + _BEYOND,
        ]
        mine, lab = seeds[window] == label, surface.lab[window]
        contours, _ = cv2.findContours(
            mine.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
        )
        within = np.zeros(mine.shape, dtype=np.uint8)
        cv2.fillConvexPoly(within, cv2.convexHull(np.concatenate(contours)), 1)
        low = cv2.dilate(within, _AROUND).view(np.bool_) & outside[window]
        if not low.any():
            continue
        color = lab[mine].mean(axis=0)
        own = np.square(lab[low] - color).sum(axis=1)
        other = np.square(lab[low] - table).sum(axis=1)
        low[low] = _MUCH_NEARER**2 * own < other
        markers[window][low] = 0


# So far beyond the outline, pixels.
_BEYOND = 8
_AROUND = np.ones((2 * _BEYOND + 1, 2 * _BEYOND + 1), dtype=np.uint8)
# Of an object is a low pixel whose colour is so many times nearer to its than to the table's.
_MUCH_NEARER = 1.4


def _flooded(lab: Image) -> npt.NDArray[np.uint8]:
    """The 8-bit image (h, w, 3) whose edges stop a flood."""
    scale = np.array([1.0 / LIGHTNESS_WEIGHT, 2.0, 2.0], dtype=np.float32)
    scaled = lab * scale + np.array([0.0, 128.0, 128.0], dtype=np.float32)
    return np.asarray(np.clip(scaled, 0.0, 255.0), dtype=np.uint8)
