"""The data files of the object catalogue: what they may say, and what is wrong with one that errs.

A file is a YAML list of objects. Lengths are metres, z is up; `config/objects/README.md` explains
every field by example.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import msgspec

from ros_scenesense.errors import SimulationError
from ros_scenesense.scene import Size, Surface
from ros_scenesense.simulation.data_files import read_data


class Color(StrEnum):
    """Colours; each occurs once in a scene, so that `<colour>_<shape>` names one object."""

    RED = "red"
    GREEN = "green"
    BLUE = "blue"
    YELLOW = "yellow"
    WHITE = "white"


Length = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Radius = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Height = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Word = Annotated[str, msgspec.Meta(pattern="^[a-z][a-z0-9_]*$", max_length=40)]
Accent = Annotated[str, msgspec.Meta(pattern="^#[0-9a-fA-F]{6}$")]
FileName = Annotated[str, msgspec.Meta(min_length=1)]
ProfilePoint = tuple[Radius, Height]
Profile = Annotated[tuple[ProfilePoint, ...], msgspec.Meta(min_length=2, max_length=64)]


class _Spec(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of all parts of a data file."""


class BoxSpec(_Spec, frozen=True):
    """A box: its edges along x, y and z; hollow and open at the top if its walls are given."""

    size_m: tuple[Length, Length, Length]
    wall_m: Length | None = None


class CylinderSpec(_Spec, frozen=True):
    """An upright cylinder."""

    diameter_m: Length
    height_m: Length


class SphereSpec(_Spec, frozen=True):
    """A sphere."""

    diameter_m: Length


class TubeSpec(_Spec, frozen=True):
    """A handle or a stem: an elliptic tube along points (x, z) in the plane y = 0.

    `width_m` is its diameter along y, `thickness_m` across its path.
    """

    path_m: Annotated[tuple[tuple[Height, Height], ...], msgspec.Meta(min_length=2, max_length=32)]
    width_m: Length
    thickness_m: Length
    color: Accent | None = None


class RevolvedSpec(_Spec, frozen=True):
    """A surface of revolution about z, open at the top if it has an inside, and its tubes.

    `outside_m` are the points (radius, z) of the outer wall from the bottom up, `inside_m` those
    of the cavity from its floor up; `flatten` scales the result along y.
    """

    outside_m: Profile
    inside_m: Annotated[tuple[ProfilePoint, ...], msgspec.Meta(max_length=64)] = ()
    flatten: Annotated[float, msgspec.Meta(gt=0.0, le=1.0)] = 1.0
    tubes: Annotated[tuple[TubeSpec, ...], msgspec.Meta(max_length=7)] = ()


class MeshSpec(_Spec, frozen=True):
    """A triangle mesh, OBJ or PLY, and optionally its convex parts as groups of an OBJ.

    Files are looked for beside the data file, then among Bullet's own. Without parts the mesh is
    decomposed. `scale` turns the file's unit into metres, `up` says which axis points up.
    """

    file: FileName
    parts: str = ""
    scale: Annotated[float, msgspec.Meta(gt=0.0, le=1000.0)] = 1.0
    up: str = "z"


class MarkSpec(_Spec, frozen=True):
    """A coloured patch: a range of the way around the object and one of its height, 0 to 1."""

    color: Accent
    around: tuple[Share, Share] = (0.0, 1.0)
    up: tuple[Share, Share] = (0.0, 1.0)


FormSpec = BoxSpec | CylinderSpec | SphereSpec | RevolvedSpec | MeshSpec
FORMS = ("box", "cylinder", "sphere", "revolved", "mesh")


class ObjectSpec(_Spec, frozen=True):
    """One object of the catalogue. Exactly one of the five forms must be given.

    Attributes:
        name: Key in the catalogue; a later file's object replaces an earlier one of its name.
        shape: Second part of the names in scenes, `<colour>_<shape>`.
        size: Size class.
        surface: Flat if and only if a centred cube put on it stays there.
        mass_kg: Mass.
        colors: Colours that it comes in; in a scene it has one of them, unique there.
        marks: Patches that keep their own colour (forms box and revolved).
        texture: Image of a mesh's own texture coordinates; its colour must be the only colour.
        open: Whether it is an open container; nothing is put on it in a stack.
        relations_only: Whether it is drawn for the arrangement `relations` alone.
        ycb: Folder of the YCB data set that can take its place.
        ycb_color: Colour of the real object there.
    """

    name: Word
    shape: Word
    size: Size
    surface: Surface
    mass_kg: Annotated[float, msgspec.Meta(gt=0.0, le=20.0)]
    box: BoxSpec | None = None
    cylinder: CylinderSpec | None = None
    sphere: SphereSpec | None = None
    revolved: RevolvedSpec | None = None
    mesh: MeshSpec | None = None
    colors: Annotated[tuple[Color, ...], msgspec.Meta(min_length=1)] = tuple(Color)
    marks: tuple[MarkSpec, ...] = ()
    texture: str = ""
    open: bool = False
    relations_only: bool = False
    ycb: str = ""
    ycb_color: Color | None = None

    @property
    def form(self) -> FormSpec:
        """The one form that is given."""
        return next(form for form in self._forms() if form is not None)

    def _forms(self) -> list[FormSpec | None]:
        return [getattr(self, name) for name in FORMS]


def read_objects(folder: Path) -> dict[str, tuple[ObjectSpec, Path]]:
    """The objects of all `*.yaml` files of a folder with the files that they come from, by name.

    Raises:
        SimulationError: If the folder or a file cannot be read or a file says something wrong; the
            text names file and field.
    """
    if not folder.is_dir():
        raise SimulationError(f"object folder {folder} is not there: give a folder of *.yaml files")
    files = sorted(folder.glob("*.yaml"))
    if not files:
        raise SimulationError(f"object folder {folder} holds no *.yaml file")
    found: dict[str, tuple[ObjectSpec, Path]] = {}
    for file in files:
        for index, spec in enumerate(_read(file)):
            if spec.name in found:
                raise SimulationError(
                    f"{file}: $[{index}].name is '{spec.name}', which {found[spec.name][1].name} "
                    "has already: names must be unique in a folder"
                )
            found[spec.name] = (spec, file)
    return found


def _read(file: Path) -> list[ObjectSpec]:
    specs = read_data(file, list[ObjectSpec])
    for index, spec in enumerate(specs):
        for field, words in _contradictions(spec):
            raise SimulationError(f"{file}: $[{index}]{field} {words}")
    return specs


def _contradictions(spec: ObjectSpec) -> Iterator[tuple[str, str]]:
    """What is wrong although every value alone is allowed: pairs of field and words."""
    given = [name for name in FORMS if getattr(spec, name) is not None]
    if len(given) != 1:
        words = f"has {' and '.join(given) or 'no form'}"
        yield "", f"{words}: give exactly one of {', '.join(FORMS)}"
    if spec.marks and not (spec.box or spec.revolved):
        yield ".marks", "are painted on boxes and revolved objects only"
    if spec.texture and (spec.mesh is None or len(spec.colors) != 1):
        yield ".texture", "needs a mesh, and as `colors` the one colour that the image shows"
    if spec.mesh is not None and spec.mesh.up not in ("y", "z"):
        yield ".mesh.up", f"is '{spec.mesh.up}', must be one of y, z"
    if spec.ycb and spec.ycb_color is None:
        yield ".ycb_color", f"is missing: the colour of {spec.ycb}"
    if spec.box is not None and spec.box.wall_m is not None:
        if 2.0 * spec.box.wall_m >= min(spec.box.size_m):
            yield ".box.wall_m", "must be less than half of every edge"
        if spec.marks:
            yield ".marks", "are painted on massive boxes only"
    if spec.revolved is not None:
        yield from _revolved_contradictions(spec.revolved)


def _revolved_contradictions(spec: RevolvedSpec) -> Iterator[tuple[str, str]]:
    field = ".revolved.inside_m"
    for name, profile in (("outside_m", spec.outside_m), ("inside_m", spec.inside_m)):
        heights = [z for _, z in profile]
        if heights != sorted(heights):
            yield f".revolved.{name}", "must go from the bottom up: z may not decrease"
    if spec.outside_m[-1][1] <= spec.outside_m[0][1]:
        yield ".revolved.outside_m", "has no height"
    if spec.inside_m and (len(spec.inside_m) < 2 or spec.inside_m[0][1] <= spec.outside_m[0][1]):
        yield field, "must have at least two points, all above the bottom"
    elif spec.inside_m and spec.inside_m[-1][1] != spec.outside_m[-1][1]:
        yield field, "must end at the height of the outside, where the rim is"
    elif spec.inside_m and any(
        radius_at(spec.inside_m, z) >= radius_at(spec.outside_m, z)
        for _, z in (*spec.inside_m, *spec.outside_m)
        if z >= spec.inside_m[0][1]
    ):
        yield field, "must lie inside the outside"


def radius_at(profile: tuple[ProfilePoint, ...], z: float) -> float:
    """Radius of a profile at a height; at a step the upper one, beyond its ends the nearest."""
    for (r0, z0), (r1, z1) in zip(reversed(profile[:-1]), reversed(profile[1:]), strict=True):
        if z0 <= z <= z1 and z1 > z0:
            return r0 + (r1 - r0) * (z - z0) / (z1 - z0)
    return profile[0][0] if z <= profile[0][1] else profile[-1][0]
