"""Surfaces of revolution with handles: what mugs, bottles and apples are, seen and felt.

What is seen is one triangle mesh; what collides is a list of convex parts that fill the same
solid: frusta where it is massive, wedges of the wall where it is hollow, pieces of the tubes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ros_scenesense.simulation.meshes import Float, Mesh, grid, joined, painted, plain
from ros_scenesense.simulation.object_files import ProfilePoint, RevolvedSpec, TubeSpec, radius_at

SEGMENTS = 48


def revolved_mesh(spec: RevolvedSpec) -> Mesh:
    """The surface with its tubes; plain cell 0 is the object's own colour, 1, ... its tubes'."""
    bottom, top = spec.outside_m[0][1], spec.outside_m[-1][1]
    outline: list[ProfilePoint] = [(0.0, bottom), *spec.outside_m]
    outline += [*reversed(spec.inside_m), (0.0, spec.inside_m[0][1] if spec.inside_m else top)]
    walls = range(1, len(spec.outside_m))  # the segments of the outline that a texture covers
    body = joined(
        [
            _ring(start, end, normals, (bottom, top) if index in walls else None)
            for index, (start, end, normals) in enumerate(_shaded(outline))
            if start != end
        ]
    )
    squash = np.array([1.0, spec.flatten, 1.0])
    normals = body.normals / squash
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    body = Mesh(body.vertices * squash, normals, body.triangles, body.uvs)
    return joined([body, *(_tube_mesh(tube, cell) for cell, tube in enumerate(spec.tubes, 1))])


def revolved_parts(spec: RevolvedSpec) -> list[Float]:
    """Vertices (V, 3) of each of the convex parts."""
    levels = sorted({z for _, z in (*spec.outside_m, *spec.inside_m)})
    massive: list[list[ProfilePoint]] = []
    parts: list[Float] = []
    for low, high in itertools.pairwise(levels):
        outer = _slab(spec.outside_m, low, high)
        if spec.inside_m and low >= spec.inside_m[0][1]:
            parts += _wedges(outer, _slab(spec.inside_m, low, high))
        elif massive and massive[-1][-1] == outer[0] and _is_convex([*massive[-1], outer[1]]):
            massive[-1].append(outer[1])
        else:
            massive.append(outer)
    angles = np.linspace(0.0, 2.0 * math.pi, _SOLID_SIDES, endpoint=False)
    parts += [np.concatenate([_circle(r, z, angles) for r, z in part]) for part in massive]
    squash = np.array([1.0, spec.flatten, 1.0])
    tubes = [part for tube in spec.tubes for part in _tube_parts(tube)]
    return [part * squash for part in parts] + tubes


_SOLID_SIDES = 24
_WEDGES = 16
_TUBE_SIDES = 12
# Neighbouring parts of the outline whose directions differ by less than this shade as one.
_CREASE_COSINE = math.cos(math.radians(40.0))


def _shaded(outline: Sequence[ProfilePoint]) -> list[tuple[ProfilePoint, ProfilePoint, Float]]:
    """Segments of the outline with the normals (2, 2) at both ends, in the half plane (r, z)."""
    along = np.diff(np.array(outline), axis=0)
    flat = np.stack([along[:, 1], -along[:, 0]], axis=-1)
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    ends = np.stack([flat, flat], axis=1)
    for index in range(len(flat) - 1):
        if flat[index] @ flat[index + 1] > _CREASE_COSINE:
            mean = flat[index] + flat[index + 1]
            ends[index, 1] = ends[index + 1, 0] = mean / np.linalg.norm(mean)
    return list(zip(outline[:-1], outline[1:], ends, strict=True))


def _ring(
    start: ProfilePoint, end: ProfilePoint, normals: Float, heights: tuple[float, float] | None
) -> Mesh:
    """A segment of the outline turned about z; painted over these heights, or plain."""
    turn = np.linspace(0.0, 1.0, SEGMENTS + 1)
    phi = 2.0 * math.pi * turn
    vertices = np.concatenate([_circle(r, z, phi) for r, z in (end, start)])
    directions = np.concatenate([_circle(r, z, phi) for r, z in (normals[1], normals[0])])
    uvs = plain(len(vertices))
    if heights is not None:
        bottom, top = heights
        uvs = np.concatenate(
            [painted(turn, (z - bottom) / (top - bottom)) for _, z in (end, start)]
        )
    return Mesh(vertices, directions, grid(1, SEGMENTS), uvs)


def _circle(radius: float, z: float, angles: npt.NDArray[np.float64]) -> Float:
    return np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full_like(angles, z)], axis=-1
    )


def _slab(profile: tuple[ProfilePoint, ...], low: float, high: float) -> list[ProfilePoint]:
    """Points of the profile just above one height and just below another one."""
    below = [point for point in profile if point[1] <= low][-1]
    above = next(point for point in profile if point[1] >= high)
    return [(radius_at((below, above), z), z) for z in (low, high)]


def _is_convex(points: Sequence[ProfilePoint]) -> bool:
    slopes = [(r1 - r0) / (z1 - z0) for (r0, z0), (r1, z1) in itertools.pairwise(points)]
    return all(upper <= lower + 1e-9 for lower, upper in itertools.pairwise(slopes))


def _wedges(outer: Sequence[ProfilePoint], inner: Sequence[ProfilePoint]) -> list[Float]:
    angles = np.linspace(0.0, 2.0 * math.pi, _WEDGES + 1)
    return [
        np.concatenate([_circle(r, z, angles[i : i + 2]) for r, z in (*outer, *inner)])
        for i in range(_WEDGES)
    ]


def _tube_rings(tube: TubeSpec, sides: int) -> tuple[Float, Float]:
    """Ellipses (P, sides + 1, 3) about the points of the path, and their normals."""
    path = np.array([(x, 0.0, z) for x, z in tube.path_m])
    along = np.gradient(path, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    across = np.cross(along, [0.0, 1.0, 0.0])
    angles = np.linspace(0.0, 2.0 * math.pi, sides + 1)
    half_width, half_thickness = tube.width_m / 2.0, tube.thickness_m / 2.0
    sideways = np.array([0.0, 1.0, 0.0]) * np.cos(angles)[:, None]
    outward = across[:, None, :] * np.sin(angles)[None, :, None]
    rings = path[:, None, :] + half_width * sideways + half_thickness * outward
    normals = sideways / half_width + outward / half_thickness
    return rings, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def _tube_mesh(tube: TubeSpec, cell: int) -> Mesh:
    rings, normals = _tube_rings(tube, _TUBE_SIDES)
    count, columns, _ = rings.shape
    side = Mesh(
        rings.reshape(-1, 3),
        normals.reshape(-1, 3),
        grid(count - 1, columns - 1)[:, ::-1],
        plain(count * columns, cell),
    )
    return joined([side, _cap(rings[0][::-1], rings[1], cell), _cap(rings[-1], rings[-2], cell)])


def _cap(ring: Float, next_ring: Float, cell: int) -> Mesh:
    """The end of a tube."""
    centre = ring[:-1].mean(axis=0)
    outward = centre - next_ring[:-1].mean(axis=0)
    outward /= max(float(np.linalg.norm(outward)), 1e-12)
    edge = np.arange(1, len(ring))
    triangles = np.stack([np.zeros_like(edge), edge, edge + 1], axis=-1)
    vertices = np.concatenate([[centre], ring])
    return Mesh(
        vertices, np.tile(outward, (len(vertices), 1)), triangles, plain(len(vertices), cell)
    )


def _tube_parts(tube: TubeSpec) -> list[Float]:
    rings, _ = _tube_rings(tube, 8)
    return [
        np.concatenate([first[:-1], second[:-1]]) for first, second in itertools.pairwise(rings)
    ]
