"""Objects as solids in space: what exact relations are computed from.

A solid is the convex hull of an object's mesh. What hangs over what, and what is inside what, is
asked for points spread evenly over the hull, the same ones for every object of a kind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float

SAMPLES = 128


@dataclass(frozen=True, eq=False)
class Solid:
    """The convex hull of an object.

    Attributes:
        vertices: (V, 3) points whose hull it is, metres.
        samples: (P, 3) points spread evenly over its volume.
        faces: (F, 4) outward unit normal n and offset d of its faces: inside, n x + d <= 0.
    """

    vertices: Float
    samples: Float
    faces: Float

    def moved(self, rotation: Float, shift: Float) -> Solid:
        """The solid after a rotation (3, 3) about the origin and then a shift (3,)."""
        normals = self.faces[:, :3] @ rotation.T
        offsets = self.faces[:, 3] - normals @ shift
        return Solid(
            self.vertices @ rotation.T + shift,
            self.samples @ rotation.T + shift,
            np.column_stack([normals, offsets]),
        )

    def share_inside(self, other: Solid) -> float:
        """Share of this solid's volume that lies inside the other."""
        depth = self.samples @ other.faces[:, :3].T + other.faces[:, 3]
        return float(np.mean((depth <= 0.0).all(axis=1)))

    def share_over(self, other: Solid) -> float:
        """Share of this solid's volume whose plumb line, up and down along z, meets the other."""
        normals, offsets = other.faces[:, :3], other.faces[:, 3]
        level = self.samples[:, :2] @ normals[:, :2].T + offsets  # (P, F)
        rise = normals[:, 2]
        roof, floor = rise > _VERTICAL, rise < -_VERTICAL
        highest = (-level[:, roof] / rise[roof]).min(axis=1)
        lowest = (-level[:, floor] / rise[floor]).max(axis=1)
        between = (level[:, ~roof & ~floor] <= 0.0).all(axis=1)
        return float(np.mean(between & (lowest <= highest)))


def convex_solid(vertices: Float) -> Solid:
    """The solid spanned by points (V, 3) that do not lie in one plane."""
    from scipy.spatial import ConvexHull  # takes a second, which only engines should pay

    hull = ConvexHull(vertices)
    # Flat sides come as several triangles each.
    faces = np.unique(np.round(hull.equations, 9), axis=0)
    corners = np.asarray(vertices[hull.vertices], dtype=np.float64)
    return Solid(corners, _spread(corners, faces), faces)


_VERTICAL = 1e-6
# Roberts' R3 sequence: evenly spread, without chance.
_STEPS = 1.2207440846057596 ** -np.arange(1.0, 4.0)


def _spread(corners: Float, faces: Float) -> Float:
    low, high = corners.min(axis=0), corners.max(axis=0)
    count = 4 * SAMPLES
    while True:
        unit = np.mod(0.5 + np.arange(1, count + 1)[:, None] * _STEPS, 1.0)
        points = low + unit * (high - low)
        inside = points[(points @ faces[:, :3].T + faces[:, 3] <= 0.0).all(axis=1)]
        if len(inside) >= SAMPLES:
            return np.asarray(inside[:SAMPLES])
        count *= 2
