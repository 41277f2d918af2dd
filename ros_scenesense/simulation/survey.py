"""Measures the physics world for exact relations: its bodies as solids, and how near they come."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pybullet

from ros_scenesense.geometry import Float, rotation_matrix
from ros_scenesense.simulation import meshes
from ros_scenesense.simulation.relations import Contact
from ros_scenesense.simulation.solids import Solid, convex_solid

if TYPE_CHECKING:
    from ros_scenesense.simulation.catalogue import CatalogueItem
    from ros_scenesense.simulation.world import Body, World


class Surveyor:
    """Measures bodies as they stand; remembers only the hull of every kind of object.

    Args:
        world: What it measures.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._kinds: dict[CatalogueItem, Solid] = {}

    def solids(self) -> list[Solid]:
        """The hulls of all bodies in the world frame."""
        return [self._solid(body) for body in self._world.bodies]

    def contacts(self) -> dict[tuple[int, int], Contact]:
        """How near each pair of bodies comes: of i to j by (i, j), i < j."""
        bodies = self._world.bodies
        return {
            (i, j): self._contact(bodies[i], bodies[j])
            for j in range(len(bodies))
            for i in range(j)
        }

    def _solid(self, body: Body) -> Solid:
        kind = body.piece.item
        if kind not in self._kinds:
            self._kinds[kind] = convex_solid(_vertices(body.id, self._world.client))
        position, orientation = pybullet.getBasePositionAndOrientation(
            body.id, physicsClientId=self._world.client
        )
        return self._kinds[kind].moved(rotation_matrix(orientation), np.asarray(position))

    def _contact(self, body: Body, other: Body) -> Contact:
        points = pybullet.getClosestPoints(
            body.id, other.id, _FARTHEST_M, physicsClientId=self._world.client
        )
        nearest = min((float(point[8]) for point in points), default=_FARTHEST_M)
        # Of several places where they meet, the most level one carries.
        normals = [float(point[7][2]) for point in points if point[8] <= nearest + _SAME_M]
        return Contact(max(0.0, nearest), max(normals, key=abs, default=0.0))


_FARTHEST_M = 10.0
_SAME_M = 0.0005
_SEGMENTS = 32


def _vertices(body: int, client: int) -> Float:
    """Points (V, 3) that span what collides of a body, in its own frame."""
    shapes = pybullet.getCollisionShapeData(body, -1, physicsClientId=client)
    if any(shape[2] == pybullet.GEOM_MESH for shape in shapes):
        return np.array(pybullet.getMeshData(body, -1, physicsClientId=client)[1])
    return np.concatenate(
        [
            _primitive(shape[2], shape[3]) @ rotation_matrix(shape[6]).T + np.asarray(shape[5])
            for shape in shapes
        ]
    )


def _primitive(kind: int, size: tuple[float, float, float]) -> Float:
    if kind == pybullet.GEOM_SPHERE:
        return meshes.sphere(size[0], _SEGMENTS).vertices
    if kind == pybullet.GEOM_CYLINDER:
        height, radius = size[0], size[1]
        return meshes.cylinder(radius, height, _SEGMENTS).vertices
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.asarray(signs * np.asarray(size) / 2.0)
