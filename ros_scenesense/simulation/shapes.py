"""Forms in Bullet's terms: what collides, what is seen, and its texture.

The origin of every shape is its centre of mass, so that a body's position is that of its mass.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pybullet

from ros_scenesense.simulation.convex import parts_file_text
from ros_scenesense.simulation.forms import Form
from ros_scenesense.simulation.object_files import BoxSpec, CylinderSpec, SphereSpec
from ros_scenesense.simulation.painting import Image, write_png


def create_collision_shape(form: Form, client: int) -> int:
    """What collides of a form; Bullet's id of it."""
    match form.primitive:
        case BoxSpec(size_m=size):
            half = [edge / 2.0 for edge in size]
            arguments = {"shapeType": pybullet.GEOM_BOX, "halfExtents": half}
        case CylinderSpec(diameter_m=diameter, height_m=height):
            arguments = {
                "shapeType": pybullet.GEOM_CYLINDER,
                "radius": diameter / 2.0,
                "height": height,
            }
        case SphereSpec(diameter_m=diameter):
            arguments = {"shapeType": pybullet.GEOM_SPHERE, "radius": diameter / 2.0}
        case _:
            return _create_compound(form, client)
    return int(pybullet.createCollisionShape(**arguments, physicsClientId=client))


def create_visual_shape(form: Form, rgba: list[float], client: int) -> int:
    """What is seen of a form; Bullet's id of it."""
    arguments: dict[str, object] = {
        "rgbaColor": rgba,
        "specularColor": [0.1, 0.1, 0.1],
        "shapeType": pybullet.GEOM_MESH,
        "vertices": form.mesh.vertices.tolist(),
        "indices": form.mesh.triangles.ravel().tolist(),
        "normals": form.mesh.normals.tolist(),
        "uvs": form.mesh.uvs.tolist(),
    }
    return int(pybullet.createVisualShape(**arguments, physicsClientId=client))


def load_texture(image: Image, client: int) -> int:
    """Gives Bullet an image (H, W, 3) RGB; its id of it."""
    with TemporaryDirectory(prefix="scenesense-") as folder:
        path = Path(folder, "texture.png")
        write_png(path, image)
        return int(pybullet.loadTexture(str(path), physicsClientId=client))


def _create_compound(form: Form, client: int) -> int:
    # Bullet makes one body of many convex parts only from a file.
    with TemporaryDirectory(prefix="scenesense-") as folder:
        path = Path(folder, "parts.obj")
        path.write_text(parts_file_text(form.parts))
        return int(
            pybullet.createCollisionShape(
                pybullet.GEOM_MESH, fileName=str(path), physicsClientId=client
            )
        )
