"""From the words of a data file to a body: what is seen, what collides, how its mass is spread."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from ros_scenesense.errors import SimulationError
from ros_scenesense.simulation import meshes
from ros_scenesense.simulation.convex import decomposed, mass_properties
from ros_scenesense.simulation.mesh_files import find_mesh, read_groups, read_mesh
from ros_scenesense.simulation.meshes import Float, Mesh
from ros_scenesense.simulation.object_files import (
    BoxSpec,
    CylinderSpec,
    FormSpec,
    MeshSpec,
    RevolvedSpec,
    SphereSpec,
)
from ros_scenesense.simulation.revolved import revolved_mesh, revolved_parts


@dataclass(frozen=True, eq=False)
class Form:
    """The body of an object; its origin is its centre of mass.

    Attributes:
        mesh: What is seen.
        primitive: What collides, if it is one of Bullet's own shapes.
        parts: What collides otherwise: vertices (V, 3) of convex parts.
        inertia: (3,) diagonal of the inertia per kilogram, m^2; the products, at most a few
            percent of it, are left out. None where Bullet knows it exactly.
    """

    mesh: Mesh
    primitive: BoxSpec | CylinderSpec | SphereSpec | None = None
    parts: tuple[Float, ...] = ()
    inertia: Float | None = None

    @property
    def convex_parts(self) -> tuple[Float, ...]:
        """Corners (V, 3) of the convex parts that it is made of."""
        return self.parts or (self.mesh.vertices,)


@dataclass(frozen=True)
class Measures:
    """Lengths of an upright form in metres.

    Attributes:
        width_m: Its smaller horizontal extent.
        height_m: Its vertical extent.
        radius_m: Radius of the upright circle about the centre of mass that holds its footprint.
        base_m: Least width of what it stands on; 0 for a sphere.
    """

    width_m: float
    height_m: float
    radius_m: float
    base_m: float


def make_form(spec: FormSpec, folder: Path) -> Form:
    """Builds a form.

    Args:
        spec: What the data file says.
        folder: Where the data file is, and the files that it names.

    Raises:
        SimulationError: If a mesh file is missing or broken; names it.
    """
    if isinstance(spec, BoxSpec) and spec.wall_m is not None:
        boards = _boards(spec.size_m, spec.wall_m)
        return _centred(meshes.joined(boards), [board.vertices for board in boards])
    if isinstance(spec, BoxSpec):
        return Form(meshes.box(spec.size_m), spec)
    if isinstance(spec, CylinderSpec):
        return Form(meshes.cylinder(spec.diameter_m / 2.0, spec.height_m), spec)
    if isinstance(spec, SphereSpec):
        return Form(meshes.sphere(spec.diameter_m / 2.0), spec)
    if isinstance(spec, RevolvedSpec):
        return _centred(revolved_mesh(spec), revolved_parts(spec))
    return _from_files(spec, folder)


def measure(form: Form) -> Measures:
    """Measures a form as it stands upright."""
    vertices = form.mesh.vertices
    extent = np.ptp(vertices, axis=0)
    footing = vertices[vertices[:, 2] < vertices[:, 2].min() + _FOOTING_M][:, :2]
    angles = np.linspace(0.0, np.pi, 24, endpoint=False)
    across = footing @ np.stack([np.cos(angles), np.sin(angles)])
    return Measures(
        width_m=float(extent[:2].min()),
        height_m=float(extent[2]),
        radius_m=float(np.linalg.norm(vertices[:, :2], axis=1).max()),
        base_m=0.0
        if isinstance(form.primitive, SphereSpec)
        else float(np.ptp(across, axis=0).min()),
    )


# What is at most this far above the lowest point is what an object stands on.
_FOOTING_M = 0.002
_LARGEST_M = 1.0
# Turns y-up into z-up.
_FROM_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def _boards(size_m: tuple[float, float, float], wall_m: float) -> list[Mesh]:
    """Floor and walls of an open box about the origin."""
    x, y, z = size_m
    floor = (meshes.box((x, y, wall_m)), (0.0, 0.0, (wall_m - z) / 2.0))
    height, rise, inner = z - wall_m, wall_m / 2.0, x - 2.0 * wall_m
    boards = [floor]
    for sign in (-1.0, 1.0):
        side = meshes.box((wall_m, y, height))
        boards.append((side, (sign * (x - wall_m) / 2.0, 0.0, rise)))
        end = meshes.box((inner, wall_m, height))
        boards.append((end, (0.0, sign * (y - wall_m) / 2.0, rise)))
    return [replace(mesh, vertices=mesh.vertices + np.array(shift)) for mesh, shift in boards]


def _from_files(spec: MeshSpec, folder: Path) -> Form:
    path = find_mesh(spec.file, folder)
    turn = spec.scale * (_FROM_Y_UP if spec.up == "y" else np.eye(3))
    mesh = read_mesh(path)
    vertices = mesh.vertices @ turn.T
    if np.ptp(vertices, axis=0).max() > _LARGEST_M:
        raise SimulationError(
            f"mesh {path} is {np.ptp(vertices, axis=0).max():.3g} m long, at most {_LARGEST_M:g} m "
            "fit on the table: set `scale` to what one of its units is in metres"
        )
    mesh = replace(mesh, vertices=vertices, normals=mesh.normals @ turn.T / spec.scale)
    if not spec.parts:
        return _centred(mesh, decomposed(mesh, path), path)
    parts_path = find_mesh(spec.parts, folder)
    return _centred(mesh, [part @ turn.T for part in read_groups(parts_path)], parts_path)


def _centred(mesh: Mesh, parts: list[Float], origin: Path | None = None) -> Form:
    try:
        properties = mass_properties(parts)
        hulls = [part[ConvexHull(part).vertices] for part in parts]
    except SimulationError as error:
        raise SimulationError(f"{origin}: {error}") from error
    return Form(
        replace(mesh, vertices=mesh.vertices - properties.centre),
        parts=tuple(part - properties.centre for part in hulls),
        inertia=properties.inertia,
    )
