"""Where the objects of the world come from: shipped files, the user's, the YCB set.

Their fingerprint is about all that these files say: other content, other scenes.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import msgspec

from ros_scenesense.errors import SimulationError
from ros_scenesense.resources import resource
from ros_scenesense.simulation.mesh_files import find_mesh
from ros_scenesense.simulation.object_files import ObjectSpec, read_objects
from ros_scenesense.simulation.ycb import replace_by_ycb


def object_specs(objects_dir: str = "", ycb_dir: str = "") -> dict[str, tuple[ObjectSpec, Path]]:
    """All objects, by name, with the data files that describe them.

    Args:
        objects_dir: Folder with further `*.yaml` files; empty = none.
        ycb_dir: Folder of the YCB data set, whose meshes replace their stand-ins; empty = none.

    Raises:
        SimulationError: If a data file or a mesh is missing or wrong.
    """
    specs = read_objects(resource("config", "objects"))
    if objects_dir:
        specs |= read_objects(Path(objects_dir))
    if ycb_dir:
        specs = replace_by_ycb(specs, Path(ycb_dir))
    return specs


def objects_fingerprint(objects_dir: str = "", ycb_dir: str = "") -> str:
    """Text that is equal if and only if the objects are: what files say, not where they are.

    Args:
        objects_dir: As for `object_specs`.
        ycb_dir: As for `object_specs`.

    Raises:
        SimulationError: If a file is missing, cannot be read or is wrong.
    """
    digest = hashlib.sha256()
    for _, (spec, file) in sorted(object_specs(objects_dir, ycb_dir).items()):
        files = [file.parent / spec.texture] if spec.texture else []
        mesh = spec.mesh
        if mesh is not None:
            names = (mesh.file, mesh.parts) if mesh.parts else (mesh.file,)
            files += [find_mesh(name, file.parent) for name in names]
            mesh = msgspec.structs.replace(mesh, file="mesh", parts="parts" if mesh.parts else "")
        said = msgspec.structs.replace(spec, mesh=mesh, texture="")
        for content in (msgspec.json.encode(said), *map(_content, files)):
            digest.update(hashlib.sha256(content).digest())
    return digest.hexdigest()[:16]


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise SimulationError(f"{file} cannot be read: {error.strerror}") from error
