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
    markers[_holes_elsewhere(rising, read | solid)] = background
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
_BRIDGE = np.ones((7, 7), dtype=np.uint8)
# So near an object even pixels that read as table may be its foot.
_RING = np.ones((13, 13), dtype=np.uint8)
_NEIGHBOURS = np.ones((3, 3), dtype=np.uint8)


def _closed(rising: Mask, read: Mask) -> Mask:
    """What rises, with the small holes in its readings."""
    closed = cv2.morphologyEx(rising.view(np.uint8), cv2.MORPH_CLOSE, _BRIDGE).view(np.bool_)
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


def _holes_elsewhere(rising: Mask, known: Mask) -> Mask:
    """Pixels without a reading in holes that border on nothing that rises."""
    _, holes = cv2.connectedComponents((~known).view(np.uint8), connectivity=8)
    bordering = np.unique(holes[cv2.dilate(rising.view(np.uint8), _NEIGHBOURS).view(np.bool_)])
    elsewhere = np.ones(int(holes.max()) + 1, dtype=np.bool_)
    elsewhere[bordering] = False
    elsewhere[0] = False
    return np.asarray(elsewhere[holes])


def _let_in(markers: Labels, background: int, seeds: Labels, surface: Surface) -> None:
    """Opens what one object encloses, if it has more of its colour than of the table's.

    The floor of a bowl or a tray is hardly higher than the table on which it stands.
    """
    outside = markers == background
    count, parts, boxes, _ = cv2.connectedComponentsWithStats(outside.view(np.uint8))
    if count <= 2:
        return
    height, width = markers.shape
    table = np.median(surface.lab[outside][:: max(1, outside.sum() // 2000)], axis=0)
    for part in range(1, count):
        x, y, w, h, area = (int(value) for value in boxes[part])
        if area < _LEAST_PIXELS or x == 0 or y == 0 or x + w == width or y + h == height:
            continue
        window = np.s_[
            max(0, y - _LOOK_ROUND) : y + h + _LOOK_ROUND,
            max(0, x - _LOOK_ROUND) : x + w + _LOOK_ROUND,
        ]
        inside = parts[window] == part
        ring = cv2.dilate(inside.view(np.uint8), _AROUND).view(np.bool_) & (seeds[window] > 0)
        if not ring.any():
            continue
        mean = surface.lab[window][inside].mean(axis=0)
        wall = surface.lab[window][ring].mean(axis=0)
        if np.linalg.norm(mean - wall) < np.linalg.norm(mean - table):
            markers[window][inside] = 0


_LOOK_ROUND = 16
_AROUND = np.ones((25, 25), dtype=np.uint8)


def _flooded(lab: Image) -> npt.NDArray[np.uint8]:
    """The 8-bit image (h, w, 3) whose edges stop a flood."""
    scale = np.array([1.0 / LIGHTNESS_WEIGHT, 2.0, 2.0], dtype=np.float32)
    scaled = lab * scale + np.array([0.0, 128.0, 128.0], dtype=np.float32)
    return np.asarray(np.clip(scaled, 0.0, 255.0), dtype=np.uint8)
