"""The option `--scene` of commands that reason: files and datasets that hold a scene."""

from __future__ import annotations

import argparse
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from ros_scenesense.errors import ParameterError
from ros_scenesense.reasoning.described_scenes import (
    KnownScene,
    described_scene,
    is_recorded,
    read_content,
    recorded_scene,
)
from ros_scenesense.stages.true_scenes import true_scene

if TYPE_CHECKING:
    from ros_scenesense.simulation.engine import SimulatedScene


def add_scene_arguments(parser: argparse.ArgumentParser, required: bool = True) -> None:
    """Declares `--scene` and `--index`."""
    parser.add_argument(
        "--scene",
        type=Path,
        metavar="FILE",
        required=required,
        help="a description (objects, relations), the recorded messages of a scene, a scene file "
        "of the simulation, or the folder of a dataset",
    )
    parser.add_argument(
        "--index", type=int, metavar="INT", help="number of the scene in a dataset (default: 0)"
    )


def scene_of(arguments: argparse.Namespace) -> KnownScene:
    """The scene that the arguments name.

    Simulated scenes and those of datasets are taken as they truly are, not as a camera sees them.

    Raises:
        ParameterError: If there is no such scene.
        SceneSenseError: If the file or dataset is broken.
    """
    path: Path = arguments.scene
    if path.is_dir():
        return true_scene(_of_dataset(path, arguments.index or 0))
    if arguments.index is not None:
        raise ParameterError(f"--index: '{path}' is no dataset, leave it out")
    content = read_content(path)
    if isinstance(content["objects"], list):
        return true_scene(_simulated(path))
    if is_recorded(content):
        return recorded_scene(content, str(path))
    return described_scene(content, str(path))


def _of_dataset(path: Path, index: int) -> SimulatedScene:
    from ros_scenesense.simulation.dataset.reader import DatasetReader

    reader = DatasetReader(path)
    if not 0 <= index < len(reader):
        raise ParameterError(f"--index is {index}, '{path}' has the scenes 0 to {len(reader) - 1}")
    return reader[index]


def _simulated(path: Path) -> SimulatedScene:
    from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
    from ros_scenesense.simulation.scene_files import read_scenes

    (file,) = read_scenes(path)
    with closing(SimulationEngine(SimulationConfiguration())) as engine:
        return engine.written(file)
