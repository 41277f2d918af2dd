"""Reads triangle meshes from Wavefront (OBJ) and Stanford (PLY) files."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybullet_data

from ros_scenesense.errors import SimulationError
from ros_scenesense.simulation.meshes import Float, Mesh, smooth_normals

Triangles = npt.NDArray[np.int64]


def find_mesh(name: str, folder: Path) -> Path:
    """A mesh file beside a data file, or one of Bullet's own.

    Raises:
        SimulationError: If there is none.
    """
    for base in (folder, Path(pybullet_data.getDataPath())):
        if (base / name).is_file():
            return base / name
    raise SimulationError(f"mesh {folder / name} is missing: put it there or correct its name")


def read_mesh(path: Path) -> Mesh:
    """A mesh with its texture coordinates (zero where it has none), shaded smoothly.

    Raises:
        SimulationError: If the file cannot be read or holds no usable triangles.
    """
    try:
        if path.suffix.lower() == ".ply":
            vertices, triangles = _read_ply(path.read_bytes())
            corners, uvs = triangles, np.zeros((len(vertices), 2))
        else:
            vertices, triangles, corners, uvs = _read_obj(path.read_text(encoding="utf-8"))
        if not len(triangles):
            raise ValueError("no triangles")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise ValueError("a triangle names a vertex that is not there")
        if not np.isfinite(vertices).all() or not np.isfinite(uvs).all():
            raise ValueError("a coordinate is not finite")
    except (OSError, ValueError, IndexError, KeyError, OverflowError) as error:
        raise SimulationError(
            f"mesh {path} cannot be read ({error}): it must be an OBJ or PLY file of triangles"
        ) from error
    normals = smooth_normals(vertices, triangles)
    # A vertex is needed once per place in the texture; its normal is that of the whole surface.
    owner = np.zeros(len(uvs), dtype=np.int64)
    owner[corners.ravel()] = triangles.ravel()
    return Mesh(vertices[owner], normals[owner], corners, uvs)


def read_groups(path: Path) -> list[Float]:
    """Vertices (V, 3) of every group `o` of an OBJ file: convex parts.

    Raises:
        SimulationError: If the file cannot be read or a group is no solid.
    """
    groups: list[list[list[str]]] = []
    try:
        for line in path.read_text(encoding="utf-8").splitlines():
            words = line.split()
            if words[:1] == ["o"] or (words[:1] == ["v"] and not groups):
                groups.append([])
            if words[:1] == ["v"]:
                groups[-1].append(words[1:4])
        parts = [np.array(group, dtype=np.float64).reshape(-1, 3) for group in groups]
        if not parts or any(len(part) < 4 or not np.isfinite(part).all() for part in parts):
            raise ValueError("a group is no solid")
    except (OSError, ValueError) as error:
        raise SimulationError(
            f"convex parts {path} cannot be read ({error}): every group must be a convex solid"
        ) from error
    return parts


def _read_obj(text: str) -> tuple[Float, Triangles, Triangles, Float]:
    """Vertices, triangles of vertices, triangles of (vertex, place in the texture), places."""
    vertices, places = [], []
    triangles: list[list[int]] = []
    corners: list[list[int]] = []
    numbers: dict[tuple[int, int], int] = {}
    for line in text.splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            vertices.append([float(word) for word in words[:3]])
        elif kind == "vt":
            places.append([float(word) for word in words[:2]])
        elif kind == "f":
            face = [_corner(word, len(vertices), len(places)) for word in words]
            if len(face) < 3:
                raise ValueError(f"a face of {len(face)} corners")
            for second, third in itertools.pairwise(face[1:]):
                fan = (face[0], second, third)
                triangles.append([vertex for vertex, _ in fan])
                corners.append([numbers.setdefault(corner, len(numbers)) for corner in fan])
    uvs = [[0.0, 0.0] if place < 0 else places[place] for _, place in numbers]
    return (
        np.array(vertices, dtype=np.float64).reshape(-1, 3),
        np.array(triangles, dtype=np.int64).reshape(-1, 3),
        np.array(corners, dtype=np.int64).reshape(-1, 3),
        np.array(uvs, dtype=np.float64).reshape(-1, 2),
    )


def _corner(word: str, vertices: int, places: int) -> tuple[int, int]:
    """Indices from 0 of vertex and place; negative numbers count from the end; place -1 = none."""
    vertex, place, *_ = [*word.split("/"), ""]
    index = int(vertex)
    where = int(place) if place else 0
    return (
        index + vertices if index < 0 else index - 1,
        where + places if where < 0 else where - 1,
    )


_PLY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_BYTE_ORDER = {"binary_little_endian": "<", "binary_big_endian": ">"}


def _read_ply(content: bytes) -> tuple[Float, Triangles]:
    """Vertices and triangles of a PLY file whose first elements are vertices and triangles."""
    header, end, body = content.partition(b"end_header")
    lines = [line.split() for line in header.decode("ascii").splitlines()]
    if not end or lines[:1] != [["ply"]]:
        raise ValueError("no PLY header")
    encoding = next(line[1] for line in lines if line[:1] == ["format"])
    elements: list[tuple[str, int, list[tuple[str, ...]]]] = []
    for line in lines:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"]:
            elements[-1][2].append(tuple(line[1:]))
    (first, vertex_count, columns), (second, face_count, lists) = elements[0], elements[1]
    if (first, second) != ("vertex", "face") or lists[0][0] != "list":
        raise ValueError("vertices, then faces, are expected")
    body = body.removeprefix(b"\r").removeprefix(b"\n")
    if encoding == "ascii":
        rows = [line.split() for line in body.splitlines() if line.strip()]
        names = [column[1] for column in columns]
        places = [names.index(axis) for axis in "xyz"]
        vertices = np.array([[float(row[i]) for i in places] for row in rows[:vertex_count]])
        faces = [row[:4] for row in rows[vertex_count : vertex_count + face_count]]
        table = np.array(faces, dtype=np.int64).reshape(-1, 4)
        counts, triangles = table[:, 0], table[:, 1:]
    else:
        order = _BYTE_ORDER[encoding]
        vertex = np.dtype([(name, order + _PLY_TYPES[kind]) for kind, name in columns])
        face_fields = [("count", order + _PLY_TYPES[lists[0][1]])]
        face_fields.append(("corners", order + _PLY_TYPES[lists[0][2]], (3,)))  # type: ignore[arg-type]
        face_fields += [(name, order + _PLY_TYPES[kind]) for kind, name in lists[1:]]
        read = np.frombuffer(body, vertex, vertex_count)
        face = np.frombuffer(
            body, np.dtype(face_fields), face_count, vertex.itemsize * vertex_count
        )
        vertices = np.stack([read[axis].astype(np.float64) for axis in "xyz"], axis=-1)
        counts, triangles = face["count"], face["corners"].astype(np.int64)
    if len(vertices) != vertex_count or len(triangles) != face_count or np.any(counts != 3):
        raise ValueError("it is cut off, or a face is no triangle")
    return vertices, triangles
