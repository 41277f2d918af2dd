"""Triangle meshes for the renderer: box, cylinder and sphere, and what all meshes need.

Bullet's own sphere is so coarse that its depth misses the true sphere by millimetres, its cylinder
shades side and lid as one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a normal at every corner.

    Attributes:
        vertices: (V, 3) metres.
        normals: (V, 3) unit vectors, outward.
        triangles: (T, 3) indices of vertices, counter-clockwise from outside.
        uvs: (V, 2) places in the texture, from 0 to 1, from its lower left corner.
    """

    vertices: Float
    normals: Float
    triangles: npt.NDArray[np.int64]
    uvs: Float


CELLS = 8
STRIP = 0.125
"""Painted textures: a strip at the left, of this width, has one cell for each plain colour, the
lowest for the object's own; the rest is the outer wall, unrolled."""


def plain(count: int, cell: int = 0) -> Float:
    """Places (count, 2) in one of the cells of a painted texture."""
    return np.tile([STRIP / 2.0, (cell + 0.5) / CELLS], (count, 1))


def painted(around: npt.ArrayLike, up: npt.ArrayLike) -> Float:
    """Places (V, 2) on the unrolled outer wall: shares of the way around and of the height."""
    # Kept off the strip and off the upper border, beyond which the texture begins again.
    u = STRIP + 0.005 + (1.0 - STRIP - 0.01) * np.asarray(around)
    return np.stack(np.broadcast_arrays(u, 0.005 + 0.99 * np.asarray(up)), axis=-1)


def sphere(radius_m: float, segments: int = 48) -> Mesh:
    """A sphere about the origin."""
    rings = segments // 2
    theta = np.linspace(0.0, np.pi, rings + 1)
    phi = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    normals = np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.sin(theta), np.sin(phi)),
            np.outer(np.cos(theta), np.ones_like(phi)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    return Mesh(radius_m * normals, normals, grid(rings, segments), plain(len(normals)))


def cylinder(radius_m: float, height_m: float, segments: int = 48) -> Mesh:
    """An upright cylinder about the origin, with sharp edges."""
    phi = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    circle = np.stack([np.cos(phi), np.sin(phi), 0.0 * phi], axis=-1)
    half = np.array([0.0, 0.0, height_m / 2.0])
    side = Mesh(
        np.concatenate([radius_m * circle + half, radius_m * circle - half]),
        np.concatenate([circle, circle]),
        grid(1, segments),
        plain(2 * len(circle)),
    )
    return joined([side, _disc(circle, radius_m, half, 1.0), _disc(circle, radius_m, -half, -1.0)])


def smooth_normals(vertices: Float, triangles: npt.NDArray[np.int64]) -> Float:
    """Normal (V, 3) of every vertex: the mean of its triangles', large ones counting more."""
    corners = vertices[triangles]
    # Cross products are as long as twice the area.
    faced = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], faced)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.maximum(lengths, 1e-12))


def box(size_m: tuple[float, float, float]) -> Mesh:
    """A box about the origin; its four sides share the texture from x over y to -x and -y."""
    half = np.array(size_m) / 2.0
    sides = [
        # Outward, to the right as seen from outside, up; first and last place around.
        ((1, 0, 0), (0, 1, 0), (0, 0, 1), 0),
        ((0, 1, 0), (-1, 0, 0), (0, 0, 1), 1),
        ((-1, 0, 0), (0, -1, 0), (0, 0, 1), 2),
        ((0, -1, 0), (1, 0, 0), (0, 0, 1), 3),
        ((0, 0, 1), (0, 1, 0), (-1, 0, 0), None),
        ((0, 0, -1), (0, 1, 0), (1, 0, 0), None),
    ]
    return joined([_side(half, *side) for side in sides])


def joined(meshes: list[Mesh]) -> Mesh:
    """One mesh of several."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate(
            [mesh.triangles + start for mesh, start in zip(meshes, starts[:-1], strict=True)]
        ),
        np.concatenate([mesh.uvs for mesh in meshes]),
    )


def _side(
    half: Float,
    outward: tuple[int, ...],
    right: tuple[int, ...],
    up: tuple[int, ...],
    quarter: int | None,
) -> Mesh:
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    vertices = (np.array(outward) + signs[:, :1] * right + signs[:, 1:] * up) * half
    places = (signs + 1) / 2.0
    uvs = plain(4) if quarter is None else painted((quarter + places[:, 0]) / 4.0, places[:, 1])
    normals = np.tile(np.array(outward, dtype=np.float64), (4, 1))
    return Mesh(vertices, normals, np.array([[0, 1, 2], [0, 2, 3]]), uvs)


def grid(rows: int, columns: int) -> npt.NDArray[np.int64]:
    """Triangles between the vertices of a (rows + 1, columns + 1) grid."""
    start = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    below, right = start + columns + 1, start + 1
    return np.concatenate(
        [np.stack([start, below, right], axis=-1), np.stack([right, below, below + 1], axis=-1)]
    )


def _disc(circle: Float, radius_m: float, centre: Float, up: float) -> Mesh:
    ring = np.arange(1, len(circle))
    triangles = np.stack([np.zeros_like(ring), ring, ring + 1], axis=-1)
    vertices = np.concatenate([[centre], radius_m * circle + centre])
    normals = np.tile([0.0, 0.0, up], (len(vertices), 1))
    if up < 0.0:
        triangles = triangles[:, ::-1]
    return Mesh(vertices, normals, triangles, plain(len(vertices)))
