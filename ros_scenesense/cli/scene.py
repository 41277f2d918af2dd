"""Draw one scene, simulated, of a dataset or of a scene file, and list what is known of it."""

from __future__ import annotations

import argparse
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table
from rich.text import Text

from ros_scenesense.cli.console import console_of
from ros_scenesense.cli.declared import add_declared, value_of
from ros_scenesense.errors import ParameterError
from ros_scenesense.parameters import Parameter, build, parameters_of
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.scene_files import read_scenes

if TYPE_CHECKING:
    from ros_scenesense.simulation.engine import SimulatedScene

_EPILOG = """\
Outline and name of a stable object are green, of an unstable one red, of an ambiguous one grey;
-30% behind a name says that so much of the object is hidden.
"""
_SEED = Parameter("seed", int, 0, "seed of the simulated scenes", minimum=0)
_INDEX = Parameter("index", int, 0, "number of the scene", minimum=0)
_ARRANGEMENT = next(
    declared
    for declared in parameters_of(SimulationConfiguration)
    if declared.name == "arrangement"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense scene`."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    show = actions.add_parser("show", help="draw one scene", description=__doc__, epilog=_EPILOG)
    show.add_argument(
        "source",
        nargs="?",
        type=Path,
        metavar="FILE",
        help="scene file (see config/scenes/README.md), or folder of the dataset to take the scene "
        "from; without it the scene is drawn",
    )
    add_declared(show, (_SEED, _INDEX, _ARRANGEMENT))
    show.add_argument(
        "--out", type=Path, metavar="FILE", required=True, help="the picture, a PNG file"
    )


def run(arguments: argparse.Namespace) -> int:
    """Draws and lists a scene."""
    from ros_scenesense.demo.annotation import write_picture
    from ros_scenesense.demo.scene_picture import draw_scene

    scene = _scene_of(arguments)
    write_picture(draw_scene(scene), arguments.out)
    console = console_of(120)
    for table in _tables(scene):
        console.print(table)
    console.print(f"written: {arguments.out}", soft_wrap=True)
    return 0


def _scene_of(arguments: argparse.Namespace) -> SimulatedScene:
    index = value_of(arguments, _INDEX)
    if arguments.source is None:
        seed = value_of(arguments, _SEED)
        given = {"arrangement": arguments.arrangement or _ARRANGEMENT.default}
        with closing(SimulationEngine(build(SimulationConfiguration, given))) as engine:
            return engine.scene(seed, index)
    for name in ("seed", "arrangement"):
        if getattr(arguments, name) is not None:
            raise ParameterError(
                f"--{name}: the scene of a dataset or a file is there, leave it out"
            )
    if arguments.source.is_file():
        if arguments.index is not None:
            raise ParameterError("--index: a scene file has one scene, leave it out")
        (file,) = read_scenes(arguments.source)
        with closing(SimulationEngine(SimulationConfiguration())) as engine:
            return engine.written(file)
    return _recorded(arguments.source, index)


def _recorded(path: Path, index: int) -> SimulatedScene:
    from ros_scenesense.simulation.dataset.reader import DatasetReader

    reader = DatasetReader(path)
    if index >= len(reader):
        raise ParameterError(f"--index is {index}, '{path}' has the scenes 0 to {len(reader) - 1}")
    return reader[index]


def _tables(scene: SimulatedScene) -> tuple[Table, Table]:
    lowers: dict[str, list[str]] = {}
    for upper, lower in scene.supports:
        lowers.setdefault(upper, []).append(lower)
    objects = _table(
        f"Objects of a scene ({scene.arrangement})",
        ["object", "size", "surface", "shape", "stands on", "stable", "occluded", "visible"],
    )
    for known, label in zip(scene.objects, scene.object_labels, strict=True):
        visible = label.visible_fraction
        cells = [known.name, known.size, known.surface, known.shape]
        cells += [", ".join(lowers.get(known.name, ["table"])), label.stable, label.occluded]
        cells.append("" if visible is None else f"{100 * visible:.0f} %")
        objects.add_row(*(Text(str(cell)) for cell in cells))
    structures = _table("Structures", ["members", "stable"])
    for structure in scene.structure_labels:
        structures.add_row(Text(", ".join(structure.members)), Text(str(structure.stable)))
    return objects, structures


def _table(title: str, columns: list[str]) -> Table:
    return Table(*columns, title=title, title_justify="left", box=box.SIMPLE_HEAD, show_edge=False)
