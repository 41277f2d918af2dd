"""Triangle meshes of the round shapes and of the duck, for the renderer.

Bullet's own sphere is so coarse that its depth misses the true sphere by millimetres, its cylinder
shades side and lid as one, and its duck wears a texture that would mix with the object's colour.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import SimulationError

Float = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a normal at every corner.

    Attributes:
        vertices: (V, 3) metres.
        normals: (V, 3) unit vectors, outward.
        triangles: (T, 3) indices of vertices, counter-clockwise from outside.
    """

    vertices: Float
    normals: Float
    triangles: npt.NDArray[np.int64]


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
    return Mesh(radius_m * normals, normals, _grid(rings, segments))


def cylinder(radius_m: float, height_m: float, segments: int = 48) -> Mesh:
    """An upright cylinder about the origin, with sharp edges."""
    phi = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    circle = np.stack([np.cos(phi), np.sin(phi), 0.0 * phi], axis=-1)
    half = np.array([0.0, 0.0, height_m / 2.0])
    side = Mesh(
        np.concatenate([radius_m * circle + half, radius_m * circle - half]),
        np.concatenate([circle, circle]),
        _grid(1, segments),
    )
    return _joined([side, _disc(circle, radius_m, half, 1.0), _disc(circle, radius_m, -half, -1.0)])


def read_obj(path: Path) -> Mesh:
    """A mesh from the vertices and triangles of a Wavefront file, shaded smoothly.

    Raises:
        SimulationError: If the file cannot be read or holds no triangles.
    """
    try:
        lines = [line.split() for line in path.read_text().splitlines()]
        vertices = np.array([line[1:4] for line in lines if line[:1] == ["v"]], dtype=np.float64)
        faces = [
            [corner.split("/")[0] for corner in line[1:]] for line in lines if line[:1] == ["f"]
        ]
        triangles = np.array(faces, dtype=np.int64).reshape(-1, 3) - 1
        corners = vertices[triangles]
        if not triangles.size:
            raise ValueError("no triangles")
    except (OSError, ValueError, IndexError) as error:
        raise SimulationError(
            f"mesh {path} cannot be read ({error}): it must be a Wavefront file of triangles"
        ) from error
    # Cross products are as long as twice the area, so that large faces count more.
    faced = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], faced)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(vertices, normals / np.maximum(lengths, 1e-12), triangles)


def _grid(rows: int, columns: int) -> npt.NDArray[np.int64]:
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
    return Mesh(vertices, normals, triangles if up > 0.0 else triangles[:, ::-1])


def _joined(meshes: list[Mesh]) -> Mesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate(
            [mesh.triangles + start for mesh, start in zip(meshes, starts[:-1], strict=True)]
        ),
    )
