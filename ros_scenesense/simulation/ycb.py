"""Puts meshes of the YCB object set in the place of their stand-ins.

The folder is laid out as the data set is handed out: `NNN_name/google_16k/textured.obj` and so on,
or `NNN_name/textured.obj`; the texture is the one that the OBJ file's material names.

Source: Calli et al., *Benchmarking in Manipulation Research: The YCB Object and Model Set*, 2015.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec

from ros_scenesense.errors import SimulationError
from ros_scenesense.simulation.object_files import FORMS, MeshSpec, ObjectSpec

FOLDERS = ("google_16k", "google_64k", "google_512k", "poisson", "tsdf", "")
FILES = ("textured.obj", "nontextured.ply")


def replace_by_ycb(
    specs: Mapping[str, tuple[ObjectSpec, Path]], folder: Path
) -> dict[str, tuple[ObjectSpec, Path]]:
    """The same objects, with real meshes for those that name a folder of the data set.

    Mass, size class and surface stay those of the stand-in; the colour is that of the real object.

    Raises:
        SimulationError: If the folder, or a mesh or texture in it, is missing.
    """
    if not folder.is_dir():
        raise SimulationError(f"ycb_dir {folder} is not there: give the folder of the YCB models")
    return {
        name: (_replaced(spec, folder.resolve()) if spec.ycb else spec, file)
        for name, (spec, file) in specs.items()
    }


def _replaced(spec: ObjectSpec, folder: Path) -> ObjectSpec:
    path = _mesh_file(folder / spec.ycb)
    texture = _texture_of(path) if path.suffix == ".obj" else None
    return msgspec.structs.replace(
        spec,
        **{**dict.fromkeys(FORMS), "mesh": MeshSpec(file=str(path))},
        marks=(),
        texture=str(texture or ""),
        colors=(spec.ycb_color,),
    )


def _mesh_file(folder: Path) -> Path:
    for sub in FOLDERS:
        for name in FILES:
            path = folder / sub / name
            if path.is_file():
                return path
    raise SimulationError(
        f"{folder / FOLDERS[0] / FILES[0]} is missing, and so are {', '.join(FILES)} in its other "
        "places: download the object's models, or leave ycb_dir empty"
    )


def _texture_of(mesh: Path) -> Path | None:
    """The image that the material of an OBJ file names; None if it has none."""
    try:
        material = _named(mesh, "mtllib")
        image = _named(material, "map_Kd") if material else None
    except (OSError, UnicodeError) as error:
        raise SimulationError(f"material of mesh {mesh} cannot be read: {error}") from error
    if image is not None and not image.is_file():
        raise SimulationError(f"texture {image} of mesh {mesh} is missing")
    return image


def _named(file: Path, keyword: str) -> Path | None:
    """The file that the first line with the keyword names, which is the rest of the line."""
    with file.open(encoding="utf-8") as lines:
        for line in lines:
            word, _, rest = line.strip().partition(" ")
            if word == keyword and rest:
                return file.parent / rest.strip()
    return None
