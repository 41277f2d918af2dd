"""The shapes of the catalogue in Bullet's terms: what collides, and what is seen.

The origin of every shape is its centre of mass, so that a body's position is that of its mass.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybullet
import pybullet_data

from ros_scenesense.geometry import rotation_matrix
from ros_scenesense.simulation import meshes
from ros_scenesense.simulation.catalogue import CatalogueItem, Shape


def collision_arguments(item: CatalogueItem) -> dict[str, object]:
    """Arguments of `createCollisionShape`."""
    half = item.width_m / 2.0
    if item.shape is Shape.CUBE:
        return {"shapeType": pybullet.GEOM_BOX, "halfExtents": [half, half, half]}
    if item.shape is Shape.SPHERE:
        return {"shapeType": pybullet.GEOM_SPHERE, "radius": half}
    if item.shape is Shape.CYLINDER:
        return {"shapeType": pybullet.GEOM_CYLINDER, "radius": half, "height": item.height_m}
    scale = _duck_scale(item)
    return {
        "shapeType": pybullet.GEOM_MESH,
        "fileName": str(_DUCK_FOLDER / "duck_vhacd.obj"),
        "meshScale": [scale, scale, scale],
        "collisionFramePosition": _to_upright(-scale * _DUCK_CENTRE),
        "collisionFrameOrientation": _UPRIGHT,
    }


def visual_arguments(item: CatalogueItem) -> dict[str, object]:
    """Arguments of `createVisualShape`, without the colour."""
    half = item.width_m / 2.0
    if item.shape is Shape.CUBE:
        return {"shapeType": pybullet.GEOM_BOX, "halfExtents": [half, half, half]}
    if item.shape is Shape.SPHERE:
        mesh = meshes.sphere(half)
    elif item.shape is Shape.CYLINDER:
        mesh = meshes.cylinder(half, item.height_m)
    else:
        duck = meshes.read_obj(_DUCK_FOLDER / "duck.obj")
        mesh = meshes.Mesh(
            _to_upright(_duck_scale(item) * (duck.vertices - _DUCK_CENTRE)),
            _to_upright(duck.normals),
            duck.triangles,
        )
    return {
        "shapeType": pybullet.GEOM_MESH,
        "vertices": mesh.vertices.tolist(),
        "indices": mesh.triangles.ravel().tolist(),
        "normals": mesh.normals.tolist(),
        "uvs": np.zeros((len(mesh.vertices), 2)).tolist(),
    }


# The duck's mesh is y-up and off-centre; its centre of mass was integrated over its convex parts.
_DUCK_FOLDER = Path(pybullet_data.getDataPath())
_DUCK_LENGTH = 1.6547
_DUCK_CENTRE = np.array([-0.1530, 0.6886, 0.0410])
_DUCK_WIDTHS = 1.2
_UPRIGHT = pybullet.getQuaternionFromEuler([math.pi / 2.0, 0.0, 0.0])


def _duck_scale(item: CatalogueItem) -> float:
    return _DUCK_WIDTHS * item.width_m / _DUCK_LENGTH


def _to_upright(vectors: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Turns y-up into z-up."""
    return vectors @ rotation_matrix(_UPRIGHT).T
