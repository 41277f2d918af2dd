"""Labelled regions of interest: the pixels and labels of the scene that they are a part of."""

from contextlib import closing

import numpy as np
import pytest
from test_dataset_situations import known, labelled, record_with

from ros_scenesense.errors import DatasetError
from ros_scenesense.resources import resource
from ros_scenesense.scene import Task, Truth
from ros_scenesense.simulation.dataset.generation import generate
from ros_scenesense.simulation.dataset.metadata import DatasetOptions, describe
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.dataset.regions import (
    labelled_regions,
    possible_groups,
    region_label,
)
from ros_scenesense.simulation.dataset.statistics import statistics
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.scene_files import read_scenes


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> DatasetReader:
    path = tmp_path_factory.mktemp("regions")
    configuration = SimulationConfiguration(width=128, height=96, shadows=False)
    generate(path, describe(configuration, DatasetOptions(seed=2, count=6)))
    return DatasetReader(path)


def test_a_region_is_the_smallest_box_with_its_margin(reader: DatasetReader) -> None:
    checked = 0
    for scene in reader:
        groups = [group for _, group in possible_groups(scene)]
        for region, group in zip(labelled_regions(scene, groups, 0.0), groups, strict=True):
            assert set(region.members) == set(group)
            numbers = [one.instance for one in scene.objects if one.name in group]
            mine = np.isin(region.instances, numbers)
            # All pixels of the members, and some at every edge.
            assert np.count_nonzero(mine) == np.isin(scene.frame.instances, numbers).sum()
            for edge in (mine[0], mine[-1], mine[:, 0], mine[:, -1]):
                assert edge.any()
            height, width = region.instances.shape
            rows = slice(region.top, region.top + height)
            columns = slice(region.left, region.left + width)
            assert np.array_equal(region.color, scene.frame.color[rows, columns])
            assert np.array_equal(region.depth, scene.frame.depth[rows, columns])
            (wide,) = labelled_regions(scene, [group], 0.1)
            assert wide.color.shape[0] > height or height == 96
            assert wide.color.shape[1] > width or width == 128
            checked += 1
    assert checked > 6


def test_labels_are_those_of_the_members_in_the_order_of_the_scene(reader: DatasetReader) -> None:
    for scene in reader:
        names = [one.name for one in scene.objects]
        (region,) = labelled_regions(scene, [reversed(names)])
        assert list(region.members) == names
        assert list(region.labels) == scene.object_labels
        stacks = {tuple(label.members): label.stable for label in scene.structure_labels}
        for region in labelled_regions(scene, stacks):
            assert region.stable is stacks[tuple(sorted(region.members))]


@pytest.mark.parametrize(
    ("group", "words"),
    [
        (["red_ghost"], "red_ghost: not in the scene, which has"),
        ([], "1 to 5 objects, not 0"),
    ],
)
def test_impossible_groups_are_named(reader: DatasetReader, group: list[str], words: str) -> None:
    with pytest.raises(DatasetError, match=words):
        list(labelled_regions(reader[0], [group]))


def test_groups_are_stacks_and_what_is_behind_with_all_before_it() -> None:
    record = record_with(
        [known(name) for name in ("base", "top", "near", "far")],
        [labelled(Truth.TRUE, name=name) for name in ("base", "top", "near", "far")],
        [("top", "base")],
        [
            ("above", "top", "base"),
            ("front", "base", "far"),
            ("behind", "far", "near"),
            ("left", "near", "top"),
        ],
    )
    assert possible_groups(record) == [(Task.OCCLUSION, ("base", "far", "near"))]


def test_the_papers_scene_has_the_papers_regions() -> None:
    (file,) = read_scenes(resource("config", "scenes") / "attention.yaml")
    with closing(SimulationEngine(SimulationConfiguration(width=128, height=96))) as engine:
        scene = engine.written(file)
    assert possible_groups(scene) == [
        (Task.STABILITY, ("red_cylinder", "white_cube", "yellow_duck")),
        (Task.OCCLUSION, ("blue_mug", "red_cylinder", "white_cube")),
    ]


@pytest.mark.parametrize(
    ("truths", "expected"),
    [
        ((Truth.TRUE, Truth.TRUE), Truth.TRUE),
        ((Truth.TRUE, Truth.FALSE), Truth.FALSE),
        ((Truth.TRUE, Truth.AMBIGUOUS), Truth.AMBIGUOUS),
    ],
)
def test_a_region_is_as_stable_as_its_least_stable_object(
    truths: tuple[Truth, ...], expected: Truth
) -> None:
    labels = [labelled(truth, name=str(number)) for number, truth in enumerate(truths)]
    assert region_label(labels) is expected


def test_stats_count_regions(reader: DatasetReader) -> None:
    groups = [task for scene in reader for task, _ in possible_groups(scene)]
    found = statistics(reader.records())
    assert found.figures["regions_stability"] == groups.count(Task.STABILITY) == 4
    assert found.figures["regions_occlusion"] == groups.count(Task.OCCLUSION) > 0
    columns, rows = found.tables["Regions of interest"]
    assert columns == ["regions", "label", "true", "false", "ambiguous"]
    assert sum(rows[0][2:]) == 4
