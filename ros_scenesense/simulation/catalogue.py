"""The objects that scenes are made of, read from data files: `config/objects/*.yaml`.

The names of the attributes are the paper's (section *Reasoning and Learning Architecture*,
example of the Robot Assistant domain): size, surface, shape. Whoever wants other objects gives a
folder of such files; its objects are added, or replace shipped ones of their names.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ros_scenesense.errors import SimulationError
from ros_scenesense.scene import Size, Surface
from ros_scenesense.simulation.forms import Form, Measures, make_form, measure
from ros_scenesense.simulation.object_files import Color, MarkSpec, ObjectSpec
from ros_scenesense.simulation.object_sources import object_specs
from ros_scenesense.simulation.rooms import Room, measure_room


@dataclass(frozen=True)
class CatalogueItem:
    """An object before it has a colour and a place.

    Attributes:
        name: Its key in the catalogue.
        shape: Second part of its name in scenes, `<colour>_<shape>`.
        size: Its size class.
        surface: Flat if and only if a centred cube put on it stays there.
        mass_kg: Its mass.
        colors: The colours it comes in.
        measures: Its lengths as it stands upright.
        is_open: Whether it is an open container: what is put there may fall in.
        relations_only: Whether it is drawn for the arrangement `relations` alone.
    """

    name: str
    shape: str
    size: Size
    surface: Surface
    mass_kg: float
    colors: tuple[Color, ...]
    measures: Measures
    is_open: bool = False
    relations_only: bool = False

    @property
    def width_m(self) -> float:
        """Smaller horizontal extent."""
        return self.measures.width_m

    @property
    def height_m(self) -> float:
        """Height when it stands upright."""
        return self.measures.height_m

    @property
    def radius_m(self) -> float:
        """Radius of the upright circle about the centre of mass that holds its footprint."""
        return self.measures.radius_m

    def can_carry(self, size: Size, surface: Surface) -> bool:
        """Whether it is of this size and surface and something may stand on it in a stack."""
        return self.size is size and self.surface is surface and not self.is_open

    @property
    def is_steady(self) -> bool:
        """Whether it keeps standing when a load falls off it: not slender, and no ball."""
        return self.measures.height_m <= _SLENDER * self.measures.base_m


@dataclass(frozen=True, eq=False)
class Looks:
    """How the mesh of an object is coloured beside the colour that it has in a scene.

    Attributes:
        marks: Patches on its outer wall.
        plain: Colours of the plain cells 1, ... of its painted texture; None = its own.
        texture: Image in the mesh's own texture coordinates, or None.
    """

    marks: tuple[MarkSpec, ...] = ()
    plain: tuple[str | None, ...] = ()
    texture: Path | None = None


class Catalogue(Mapping[str, CatalogueItem]):
    """Every object there is, by name, with its form and its looks."""

    def __init__(self, entries: Mapping[str, tuple[CatalogueItem, Form, Looks]]) -> None:
        self._entries = dict(entries)
        self._rooms: dict[str, Room] = {}

    def __getitem__(self, name: str) -> CatalogueItem:
        return self._entries[name][0]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def form(self, item: CatalogueItem) -> Form:
        """The body of an item."""
        return self._entries[item.name][1]

    def room(self, item: CatalogueItem) -> Room:
        """The room inside an item, measured when it is first asked for."""
        if item.name not in self._rooms:
            self._rooms[item.name] = measure_room(self.form(item))
        return self._rooms[item.name]

    def looks(self, item: CatalogueItem) -> Looks:
        """How an item's mesh is coloured."""
        return self._entries[item.name][2]


def load_catalogue(objects_dir: str = "", ycb_dir: str = "") -> Catalogue:
    """The shipped objects and the user's.

    Args:
        objects_dir: Folder with further `*.yaml` files; empty = none.
        ycb_dir: Folder of the YCB data set, whose meshes replace their stand-ins; empty = none.

    Raises:
        SimulationError: If a data file or a mesh is missing or wrong, or the objects are too few
            to draw scenes from.
    """
    specs = object_specs(objects_dir, ycb_dir)
    catalogue = Catalogue({name: _entry(spec, file) for name, (spec, file) in specs.items()})
    _check_choice(catalogue)
    return catalogue


# Times its base that an object may be high to be called steady.
_SLENDER = 2.2


def _entry(spec: ObjectSpec, file: Path) -> tuple[CatalogueItem, Form, Looks]:
    try:
        form = make_form(spec.form, file.parent)
    except SimulationError as error:
        raise SimulationError(f"{file}, object '{spec.name}': {error}") from error
    texture = file.parent / spec.texture if spec.texture else None
    if texture is not None and not texture.is_file():
        raise SimulationError(f"{file}, object '{spec.name}': texture {texture} is missing")
    item = CatalogueItem(
        name=spec.name,
        shape=spec.shape,
        size=spec.size,
        surface=spec.surface,
        mass_kg=spec.mass_kg,
        colors=spec.colors,
        measures=measure(form),
        is_open=spec.open,
        relations_only=spec.relations_only,
    )
    tubes = spec.revolved.tubes if spec.revolved else ()
    return item, form, Looks(spec.marks, tuple(tube.color for tube in tubes), texture)


def _check_choice(catalogue: Catalogue) -> None:
    """Stacks need something to begin with, whatever size, surface and colour was drawn."""
    for size in Size:
        for surface in Surface:
            bottoms = [
                item
                for item in catalogue.values()
                if item.can_carry(size, surface) and item.is_steady
            ]
            missing = set(Color) - {color for item in bottoms for color in item.colors}
            if missing:
                raise SimulationError(
                    f"no {size} object with a {surface} surface that stacks can begin with comes "
                    f"in {', '.join(sorted(missing))}: the shipped cubes and ducks do, give "
                    "objects of your own other names"
                )
