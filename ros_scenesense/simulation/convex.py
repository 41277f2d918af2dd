"""Convex parts: mass properties, and the decomposition of a mesh into them, done once and kept."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import platformdirs
from scipy.spatial import ConvexHull, QhullError

from ros_scenesense.errors import SimulationError
from ros_scenesense.simulation.mesh_files import read_groups
from ros_scenesense.simulation.meshes import Float, Mesh


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Of a body of even density.

    Attributes:
        volume_m3: Volume.
        centre: (3,) centre of mass, metres.
        inertia: (3,) diagonal of the inertia about the centre of mass, per kilogram, m^2.
    """

    volume_m3: float
    centre: Float
    inertia: Float


def mass_properties(parts: Sequence[Float]) -> MassProperties:
    """Mass properties of the convex hulls of vertices (V, 3); where parts overlap both count.

    Raises:
        SimulationError: If the parts enclose no volume.
    """
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for part in parts:
        try:
            hull = ConvexHull(part)
        except (QhullError, ValueError) as error:
            raise SimulationError("a convex part is flat: it encloses no volume") from error
        inside = part.mean(axis=0)
        corners = part[hull.simplices]  # (T, 3, 3)
        # Tetrahedra from a point inside to the triangles; the sign of their order is of no matter.
        edges = corners - inside
        volumes = np.abs(np.linalg.det(edges)) / 6.0
        centres = (corners.sum(axis=1) + inside) / 4.0
        volume += float(volumes.sum())
        first += volumes @ centres
        # Second moment of a tetrahedron: (sum of corners squared + 16 centre squared) / 20.
        points = np.concatenate([corners, np.broadcast_to(inside, (len(corners), 1, 3))], axis=1)
        second += np.einsum("t,tij,tik->jk", volumes, points, points) / 20.0
        second += 16.0 / 20.0 * np.einsum("t,tj,tk->jk", volumes, centres, centres)
    if volume <= 0.0:
        raise SimulationError("the convex parts enclose no volume")
    centre = first / volume
    spread = np.diag(second) / volume - centre**2
    return MassProperties(volume, centre, spread.sum() - spread)


def parts_file_text(parts: Sequence[Float]) -> str:
    """The parts as an OBJ file with a group for each hull, which Bullet makes one compound of."""
    lines, first = [], 1
    for number, part in enumerate(parts):
        hull = ConvexHull(part)
        lines.append(f"o part_{number}")
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in part.tolist()]
        lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in hull.simplices.tolist()]
        first += len(part)
    return "\n".join(lines) + "\n"


def decomposed(mesh: Mesh, origin: Path) -> list[Float]:
    """Convex parts (V, 3) that together fill a mesh, by Bullet's V-HACD.

    The result is kept in the user's cache folder under a name that depends on the mesh alone.

    Args:
        mesh: In metres.
        origin: File that it comes from, for errors.

    Raises:
        SimulationError: If the mesh cannot be decomposed; names the file.
    """
    folder = platformdirs.user_cache_path("scenesense", appauthor=False) / "convex_parts"
    kept = folder / f"{_key(mesh)}.obj"
    try:
        return read_groups(kept)
    except SimulationError:
        pass  # not there yet, or damaged: made anew
    try:
        ConvexHull(mesh.vertices)
    except (QhullError, ValueError) as error:  # V-HACD would never end
        raise SimulationError(f"mesh {origin} is flat: it must enclose a volume") from error
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as working:
            made = _decompose(mesh, Path(working), origin)
            parts = read_groups(made)
            os.replace(made, kept)
    except OSError as error:
        raise SimulationError(f"convex parts cannot be kept in {folder}: {error}") from error
    return parts


_VHACD = {"resolution": 200000, "concavity": 0.001, "maxNumVerticesPerCH": 48}
_TIMEOUT_S = 180.0
# In a process of its own: it talks much, and a broken mesh may take it down.
_PROGRAM = (
    "import sys, pybullet; pybullet.vhacd(sys.argv[1], sys.argv[2], sys.argv[3], "
    + ", ".join(f"{name}={value}" for name, value in _VHACD.items())
    + ")"
)


def _key(mesh: Mesh) -> str:
    content = hashlib.sha256(repr(sorted(_VHACD.items())).encode())
    content.update(np.ascontiguousarray(mesh.vertices).tobytes())
    content.update(np.ascontiguousarray(mesh.triangles).tobytes())
    return content.hexdigest()


def _decompose(mesh: Mesh, working: Path, origin: Path) -> Path:
    given, made, log = working / "mesh.obj", working / "parts.obj", working / "log.txt"
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (mesh.triangles + 1).tolist()]
    given.write_text("\n".join(lines) + "\n")
    try:
        subprocess.run(
            [sys.executable, "-c", _PROGRAM, str(given), str(made), str(log)],
            check=True,
            capture_output=True,
            timeout=_TIMEOUT_S,
        )
        read_groups(made)
    except (subprocess.SubprocessError, SimulationError) as error:
        raise SimulationError(
            f"mesh {origin} cannot be divided into convex parts: it must enclose a volume"
        ) from error
    return made
