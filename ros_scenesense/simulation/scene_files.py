"""Scenes that somebody wrote down: which objects stand where, and from where they are seen.

A file is YAML or JSON; `config/scenes/README.md` explains every field by example. The scene is
built, rendered and labelled as one that was drawn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec

from ros_scenesense.errors import SimulationError
from ros_scenesense.simulation.arrangements import Layout, Piece
from ros_scenesense.simulation.backgrounds import MOST_BACKGROUNDS, PLAIN
from ros_scenesense.simulation.catalogue import Catalogue
from ros_scenesense.simulation.data_files import read_data
from ros_scenesense.simulation.object_files import Color, Word

WRITTEN = "written"
"""The arrangement of a scene that was not drawn."""

Coordinate = Annotated[float, msgspec.Meta(ge=-0.9, le=0.9)]
Angle = Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]


class WrittenObject(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An object that stands upright; it is lowered until it touches what is below.

    Attributes:
        object: Its name in the catalogue.
        color: Its colour; in the scene its name is `<colour>_<shape>`.
        stands_on: Name of an object further up in the list that it stands on, or in; None = the
            table.
        x_m: Forward coordinate of its centre of mass, in the world or from that of its support.
        y_m: Left coordinate of its centre of mass.
        yaw_deg: Its rotation about up.
    """

    object: Word
    color: Color
    stands_on: Word | None = None
    x_m: Coordinate = 0.0
    y_m: Coordinate = 0.0
    yaw_deg: Angle = 0.0


class WrittenCamera(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """From where a written scene is seen; the camera looks at the middle of the objects.

    Attributes:
        pitch_deg: Angle at which it looks down.
        yaw_deg: Direction in which it looks, about up; 0 = along the world's x axis.
        distance: So many times as far as it must be to see everything.
    """

    pitch_deg: Annotated[float, msgspec.Meta(ge=5.0, le=60.0)] = 22.0
    yaw_deg: Angle = 0.0
    distance: Annotated[float, msgspec.Meta(ge=1.0, le=4.0)] = 1.1


class WrittenScene(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of a scene file.

    Attributes:
        objects: What is in it, supports before what they carry.
        about: What it shows, for people.
        camera: From where it is seen.
        background: Number of the table and the wall.
    """

    # The stability test puts the structures side by side; so many fit.
    objects: Annotated[tuple[WrittenObject, ...], msgspec.Meta(min_length=1, max_length=10)]
    about: str = ""
    camera: WrittenCamera = WrittenCamera()
    background: Annotated[int, msgspec.Meta(ge=0, le=MOST_BACKGROUNDS)] = PLAIN


@dataclass(frozen=True)
class SceneFile:
    """A scene and the file that it was written in."""

    path: Path
    scene: WrittenScene

    def layout(self, catalogue: Catalogue) -> Layout:
        """What stands where.

        Raises:
            SimulationError: If an object is not in the catalogue or does not come in its colour,
                two have one name, or a support is not there; the text names file and field.
        """
        pieces: list[Piece] = []
        for number, one in enumerate(self.scene.objects):
            where = f"{self.path}: $.objects[{number}]"
            piece = _piece(one, pieces, catalogue, where)
            if piece.name in (other.name for other in pieces):
                raise SimulationError(
                    f"{where} is a second {piece.name}: names in a scene are unique, give it "
                    "another colour"
                )
            pieces.append(piece)
        return Layout(WRITTEN, tuple(pieces))


def read_scenes(path: Path) -> list[SceneFile]:
    """The scene of a file, or those of all `*.yaml` and `*.json` files of a folder, sorted by name.

    Raises:
        SimulationError: If there is none, or one cannot be read or says something wrong; the text
            names file and field.
    """
    files = [path]
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix in (".yaml", ".json"))
        if not files:
            raise SimulationError(f"scene folder {path} holds no *.yaml or *.json file")
    return [SceneFile(file, read_data(file, WrittenScene)) for file in files]


def _piece(one: WrittenObject, before: list[Piece], catalogue: Catalogue, where: str) -> Piece:
    item = catalogue.get(one.object)
    if item is None:
        raise SimulationError(
            f"{where}.object is '{one.object}', the catalogue has {', '.join(catalogue)}"
        )
    if one.color not in item.colors:
        raise SimulationError(
            f"{where}.color is {one.color}, a {one.object} comes in {', '.join(item.colors)}"
        )
    x, y, support = one.x_m, one.y_m, None
    if one.stands_on is not None:
        names = [piece.name for piece in before]
        if one.stands_on not in names:
            raise SimulationError(
                f"{where}.stands_on is '{one.stands_on}', before it there are: "
                f"{', '.join(names) or 'none'}"
            )
        support = names.index(one.stands_on)
        x, y = before[support].x_m + x, before[support].y_m + y
    return Piece(item, one.color, x, y, math.radians(one.yaw_deg), support)
