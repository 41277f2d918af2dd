"""Puts pieces together that are of one object, the surest pair first.

How sure is a score of how the two meet: convex objects that touch meet in a step or in a concave
crease, faces of one object in a convex edge; of how their colours differ, which says little where
the surface goes on smoothly; and of how hollow the outline of the two together is. Its weights, of
these features and their products, are fitted to simulated frames with and without noise, on a part
of which objects wear random prints.
"""

from __future__ import annotations

import heapq
import math

import cv2
import numpy as np
import numpy.typing as npt
from scipy.ndimage import find_objects

from ros_scenesense.geometry import Float
from ros_scenesense.perception.merge_weights import WEIGHTS
from ros_scenesense.perception.regions import Pieces
from ros_scenesense.perception.surface import Labels, Surface


def merged(pieces: Pieces, surface: Surface) -> Labels:
    """Which object each piece is of.

    Args:
        pieces: What to put together.
        surface: The part of the image that they lie in.

    Returns:
        (count + 1,) from the label of a piece to that of its object; 0 stays 0.
    """
    table = Borders(pieces, surface)
    waiting: list[tuple[float, int, int, int, int]] = []

    def propose(one: int, other: int) -> None:
        one, other = min(one, other), max(one, other)
        score = table.score(one, other)
        if score > 0.0:
            entry = (-score, one, other, table.version[one], table.version[other])
            heapq.heappush(waiting, entry)

    for one, others in enumerate(table.borders):
        for other in others:
            if one < other:
                propose(one, other)
    while waiting:
        _, one, other, *versions = heapq.heappop(waiting)
        if versions != [table.version[one], table.version[other]]:
            continue
        table.join(one, other)
        for neighbour in table.borders[one]:
            propose(one, neighbour)
    return table.objects()


# How far from a border the surfaces on both sides are compared, pixels.
_REACH = 5
# Neighbours on a border that are farther apart in space show a step.
_STEP_M = 0.015
# Normals that differ by more, along the line across the border, show a crease or an edge.
_BENT = 0.25
# Surfaces that miss each other's tangent plane by more are shifted.
_SHIFT_M = 0.006


def expanded(features: Float) -> Float:
    """A constant, the features, and their products."""
    first, second = np.triu_indices(len(features))
    return np.concatenate([[1.0], features, features[first] * features[second]])


# Columns of the sums over the pixel pairs of a border.
_PAIRS, _STEPS, _CONCAVE, _CONVEX, _SHIFTED, _COLOR = range(6)


class Borders:
    """Pieces and their borders as sums over pixels, which add up when pieces are joined.

    Attributes:
        area: Of each piece, pixels.
        borders: For each piece, by its label, the sums (6,) over the border with each neighbour.
        version: For each piece how often it changed; -1 when it is part of another one.
    """

    def __init__(self, pieces: Pieces, surface: Surface) -> None:
        labels, size = pieces.labels, pieces.count + 1
        flat = labels.ravel()
        self.area = np.bincount(flat, minlength=size).astype(np.float64)
        self._lab = np.stack(
            [np.bincount(flat, surface.lab[..., c].ravel(), minlength=size) for c in range(3)],
            axis=1,
        )
        self._outline = np.zeros(size)
        self._hulls: list[npt.NDArray[np.int32]] = [np.zeros((0, 1, 2), np.int32)] * size
        self._hull_area = np.ones(size)
        for label, window in enumerate(find_objects(labels), 1):
            if window is None:
                continue
            rows, columns = window
            mine = (labels[window] == label).view(np.uint8)
            contours, _ = cv2.findContours(mine, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
            here = np.array([[columns.start, rows.start]], dtype=np.int32)
            self._hulls[label] = _hull(np.concatenate(contours) + here)
            self._hull_area[label] = _hull_area(self._hulls[label])
        self._joined_to = np.arange(size)
        self.version = [0] * size
        self.borders: list[dict[int, Float]] = [{} for _ in range(size)]
        sums: dict[tuple[int, int], Float] = {}
        for axis in (0, 1):
            for pair, border in self._along(labels, surface, axis):
                sums[pair] = sums[pair] + border if pair in sums else border
        for (one, other), border in sums.items():
            self.borders[one][other] = self.borders[other][one] = border

    def score(self, one: int, other: int) -> float:
        """How sure it is that two neighbours are of one object; above 0 they are."""
        return float(WEIGHTS @ expanded(self.features(one, other)))

    def features(self, one: int, other: int) -> Float:
        """How two neighbours meet and how they differ, (9,), all about from 0 to 1."""
        border = self.borders[one][other]
        pairs = float(border[_PAIRS])
        step, concave, convex, shifted, local = (float(v) for v in border[1:] / pairs)
        change = self._lab[one] / self.area[one] - self._lab[other] / self.area[other]
        color = math.hypot(float(change[1]), float(change[2]))
        hull = _hull(np.concatenate([self._hulls[one], self._hulls[other]]))
        area = self.area[one] + self.area[other]
        before = area / (self._hull_area[one] + self._hull_area[other])
        together = area / _hull_area(hull)
        return np.array(
            [
                step,
                concave,
                convex,
                shifted,
                min(color / 20.0, 1.0),
                min(color / 80.0, 1.0),
                min(local / 40.0, 1.0),
                pairs / max(1.0, min(self._outline[one], self._outline[other])),
                max(0.0, before - together),
            ]
        )

    def join(self, one: int, other: int) -> None:
        """Makes the other piece part of the first."""
        between = self.borders[one].pop(other)
        del self.borders[other][one]
        self._outline[one] += self._outline[other] - 2.0 * between[_PAIRS]
        self.area[one] += self.area[other]
        self._lab[one] += self._lab[other]
        self._hulls[one] = _hull(np.concatenate([self._hulls[one], self._hulls[other]]))
        self._hull_area[one] = _hull_area(self._hulls[one])
        for neighbour, border in self.borders[other].items():
            del self.borders[neighbour][other]
            known = self.borders[one].get(neighbour)
            together = border if known is None else known + border
            self.borders[one][neighbour] = self.borders[neighbour][one] = together
        self.borders[other] = {}
        self._joined_to[other] = one
        self.version[one] += 1
        self.version[other] = -1

    def objects(self) -> Labels:
        """For each piece the label of what it was joined to in the end."""
        roots = self._joined_to
        while not np.array_equal(roots, roots[roots]):
            roots = roots[roots]
        return roots.astype(np.int32)

    def _along(
        self, labels: Labels, surface: Surface, axis: int
    ) -> list[tuple[tuple[int, int], Float]]:
        """The sums of the borders that the lines along an image axis cross."""
        size = len(self.area)
        first = labels[:-1] if axis == 0 else labels[:, :-1]
        second = labels[1:] if axis == 0 else labels[:, 1:]
        y, x = np.nonzero(first != second)
        one, other = first[y, x], second[y, x]
        self._outline += np.bincount(one, minlength=size) + np.bincount(other, minlength=size)
        inner = (one > 0) & (other > 0)
        y, x, one, other = y[inner], x[inner], one[inner], other[inner]
        if len(y) == 0:
            return []
        dy, dx = (1, 0) if axis == 0 else (0, 1)
        here, there = (y, x), (y + dy, x + dx)
        far_here = _inside(labels, here, one, -_REACH * dy, -_REACH * dx)
        far_there = _inside(labels, there, other, _REACH * dy, _REACH * dx)
        gap = np.linalg.norm(surface.points[here] - surface.points[there], axis=1)
        across = surface.points[far_there] - surface.points[far_here]
        normal_here, normal_there = surface.normals[far_here], surface.normals[far_there]
        turn = np.einsum("nc,nc->n", normal_there - normal_here, across)
        turn /= np.maximum(np.linalg.norm(across, axis=1), 1e-9)
        missed = np.minimum(
            np.abs(np.einsum("nc,nc->n", across, normal_here)),
            np.abs(np.einsum("nc,nc->n", across, normal_there)),
        )
        step = gap > _STEP_M
        observed = np.stack(
            [
                np.ones(len(y)),
                step,
                (turn < -_BENT) & ~step,
                (turn > _BENT) & ~step,
                (missed > _SHIFT_M) & ~step,
                np.linalg.norm(surface.lab[far_here] - surface.lab[far_there], axis=1),
            ],
            axis=1,
        )
        codes = np.minimum(one, other).astype(np.int64) * size + np.maximum(one, other)
        found, pair_of = np.unique(codes, return_inverse=True)
        sums = np.stack(
            [np.bincount(pair_of, column, minlength=len(found)) for column in observed.T], axis=1
        )
        return [((int(c) // size, int(c) % size), row) for c, row in zip(found, sums, strict=True)]


Pixels = tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]


def _hull(places: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Convex hull (K, 1, 2) of pixels (N, 1, 2), column first."""
    return np.asarray(cv2.convexHull(places), dtype=np.int32)


def _hull_area(hull: npt.NDArray[np.int32]) -> float:
    """About how many pixels a hull holds, its outline too."""
    return float(cv2.contourArea(hull)) + len(hull)


def _inside(labels: Labels, pixels: Pixels, owner: Labels, dy: int, dx: int) -> Pixels:
    """The pixels moved away from the border, where that does not leave their piece."""
    y = np.clip(pixels[0] + dy, 0, labels.shape[0] - 1)
    x = np.clip(pixels[1] + dx, 0, labels.shape[1] - 1)
    stays = labels[y, x] == owner
    return np.where(stays, y, pixels[0]), np.where(stays, x, pixels[1])
