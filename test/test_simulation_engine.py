"""Whole scenes: images that fit the geometry, labels that mean what they say, determinism."""

import dataclasses
import math
import pickle
from collections.abc import Iterator

import numpy as np
import pybullet
import pytest

from ros_scenesense.errors import ParameterError, SimulationError
from ros_scenesense.geometry import rotation_matrix, transform_points
from ros_scenesense.scene import Surface, Truth, find_structures
from ros_scenesense.simulation import occlusion
from ros_scenesense.simulation.arrangements import Arrangement
from ros_scenesense.simulation.engine import (
    CAMERA_FRAME,
    PlacedObject,
    SimulatedScene,
    SimulationConfiguration,
    SimulationEngine,
)
from ros_scenesense.simulation.stability import stability, structure_stability
from ros_scenesense.simulation.wish import Wish
from ros_scenesense.simulation.world import COLORS, World

MILLIMETRE = 0.001


@pytest.fixture(scope="module")
def engine() -> Iterator[SimulationEngine]:
    engine = SimulationEngine(SimulationConfiguration())
    yield engine
    engine.close()


@pytest.fixture(scope="module")
def scenes(engine: SimulationEngine) -> list[SimulatedScene]:
    return [engine.scene(0, index) for index in range(24)]


def content(scene: SimulatedScene) -> list[object]:
    frame = scene.frame
    images = [image.tobytes() for image in (frame.color, frame.depth, frame.instances)]
    poses = [placed.pose for placed in scene.placed]
    labels = [scene.object_labels, scene.structure_labels]
    return [*images, frame.camera_pose, poses, scene.objects, scene.supports, *labels]


def points_in_world(scene: SimulatedScene) -> np.ndarray:
    points = scene.frame.intrinsics.back_project(scene.frame.depth)
    return transform_points(scene.frame.camera_pose.matrix(), points)


def test_what_borders_on_nothing_nearer_needs_no_picture_of_its_own(
    engine: SimulationEngine, scenes: list[SimulatedScene], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(occlusion, "_may_be_hidden", lambda *_: True)
    for index in range(12):
        scene = engine.scene(0, index)
        assert scene.object_labels == scenes[index].object_labels
        assert scene.hidden == scenes[index].hidden


def test_a_frame_is_complete(scenes: list[SimulatedScene]) -> None:
    frame = scenes[0].frame
    assert frame.frame_id == CAMERA_FRAME
    assert frame.stamp_ns == 0
    assert (frame.intrinsics.cx, frame.intrinsics.cy) == (160.0, 119.0)
    assert frame.color.shape == (240, 320, 3)
    assert frame.depth.dtype == np.float32
    assert frame.instances.dtype == np.uint16
    assert frame.camera_pose.position[0] < 0.0


def test_background_has_no_instance_and_the_wall_no_depth(scenes: list[SimulatedScene]) -> None:
    walls = 0
    for scene in scenes:
        numbers = set(np.unique(scene.frame.instances).tolist())
        assert numbers == {0, *(known.instance for known in scene.objects)}
        wall = scene.frame.depth == 0.0
        assert not scene.frame.instances[wall].any()
        assert np.isfinite(scene.frame.depth).all()
        walls += int(wall.any())
    assert walls > 0


def test_the_table_is_the_plane_z_0(scenes: list[SimulatedScene]) -> None:
    for scene in scenes:
        table = (scene.frame.instances == 0) & (scene.frame.depth > 0.0)
        heights = points_in_world(scene)[table][:, 2]
        assert np.abs(heights).max() < 1e-5


def distance_to_surface(placed: PlacedObject, points: np.ndarray) -> np.ndarray:
    item = placed.piece.item
    rotation = rotation_matrix(placed.pose.orientation)
    local = (points - np.array(placed.pose.position)) @ rotation
    if item.shape == "sphere":
        return np.abs(np.linalg.norm(local, axis=1) - item.width_m / 2.0)
    if item.shape == "cube":
        return np.abs(np.abs(local).max(axis=1) - item.width_m / 2.0)
    side = np.hypot(local[:, 0], local[:, 1]) - item.width_m / 2.0
    lid = np.abs(local[:, 2]) - item.height_m / 2.0
    return np.abs(np.maximum(side, lid))


def test_depth_agrees_with_the_shapes(scenes: list[SimulatedScene]) -> None:
    checked = set()
    for scene in scenes:
        points = points_in_world(scene)
        for known, placed in zip(scene.objects, scene.placed, strict=True):
            if placed.piece.item.shape in ("cube", "sphere", "cylinder"):
                seen = points[scene.frame.instances == known.instance]
                assert distance_to_surface(placed, seen).max() < MILLIMETRE
                checked.add(placed.piece.item.shape)
    assert checked == {"cube", "sphere", "cylinder"}


def test_the_top_of_a_cube_is_at_its_height(scenes: list[SimulatedScene]) -> None:
    tops = []
    for scene in scenes:
        points = points_in_world(scene)
        for known, placed in zip(scene.objects, scene.placed, strict=True):
            on_table = placed.piece.support is None
            carries = known.name in {lower for _, lower in scene.supports}
            if placed.piece.item.shape == "cube" and on_table and not carries:
                seen = points[scene.frame.instances == known.instance]
                tops.append(seen[:, 2].max() - placed.piece.item.height_m)
    assert tops
    assert np.abs(tops).max() < MILLIMETRE


def test_objects_are_wholly_in_the_image_and_fill_it(scenes: list[SimulatedScene]) -> None:
    extents = []
    for scene in scenes:
        rows, columns = np.nonzero(scene.frame.instances)
        assert rows.min() > 0
        assert rows.max() < 239
        assert columns.min() > 0
        assert columns.max() < 319
        extents.append(max(np.ptp(rows) / 240.0, np.ptp(columns) / 320.0))
        for known in scene.objects:
            assert np.count_nonzero(scene.frame.instances == known.instance) >= 38
    assert min(extents) > 0.35
    assert np.mean(extents) > 0.55


def test_colours_are_true_and_names_unique(scenes: list[SimulatedScene]) -> None:
    palette = np.array(list(COLORS.values()))
    for scene in scenes:
        assert len({known.name for known in scene.objects}) == len(scene.objects)
        assert len({known.color for known in scene.objects}) == len(scene.objects)
        for known in scene.objects:
            assert known.name == f"{known.color}_{known.shape}"
            seen = scene.frame.color[scene.frame.instances == known.instance]
            mean = seen.mean(axis=0)
            # Light changes the brightness; the hue must remain.
            ratio = palette / np.linalg.norm(palette, axis=1, keepdims=True)
            likeness = ratio @ (mean / np.linalg.norm(mean))
            assert list(COLORS)[int(np.argmax(likeness))] == known.color
            assert mean.max() > 60.0


def test_labels_belong_to_objects_and_structures(scenes: list[SimulatedScene]) -> None:
    for scene in scenes:
        names = [known.name for known in scene.objects]
        assert [known.instance for known in scene.objects] == list(range(1, len(names) + 1))
        assert [label.name for label in scene.object_labels] == names
        structures = find_structures(names, scene.supports)
        assert [tuple(label.members) for label in scene.structure_labels] == structures
        stable = {label.name: label.stable for label in scene.object_labels}
        for label in scene.structure_labels:
            assert label.stable is structure_stability(label.members, stable)
        for label in scene.object_labels:
            assert 0.0 < label.visible_fraction <= 1.0


def test_the_strict_axioms_are_true(scenes: list[SimulatedScene]) -> None:
    """Stable unless above something; unstable above an irregular object; seen if nothing hides."""
    above_nothing, above_irregular, stacked = [], [], []
    for scene in scenes:
        below = dict(scene.supports)
        surface = {known.name: known.surface for known in scene.objects}
        for label in scene.object_labels:
            chain, name = [], label.name
            while name in below:
                name = below[name]
                chain.append(surface[name])
            if not chain:
                above_nothing.append(label.stable is not Truth.FALSE)
                continue
            stacked.append(label.stable)
            if Surface.IRREGULAR in chain:
                above_irregular.append(label.stable is not Truth.TRUE)
    assert np.mean(above_nothing) >= 0.97
    assert above_irregular
    assert np.mean(above_irregular) >= 0.97
    assert 0.2 < np.mean([truth is Truth.FALSE for truth in stacked]) < 0.8


def test_what_has_nothing_in_front_is_not_occluded(scenes: list[SimulatedScene]) -> None:
    free = []
    for scene in scenes:
        away = np.array(rotation_matrix(scene.frame.camera_pose.orientation)[:, 2])
        away[2] = 0.0
        away /= np.linalg.norm(away)
        depths = [float(np.array(placed.pose.position) @ away) for placed in scene.placed]
        for label, depth in zip(scene.object_labels, depths, strict=True):
            if depth - min(depths) < 0.04:
                free.append(label.occluded is not Truth.TRUE)
    assert np.mean(free) >= 0.97
    occluded = [label.occluded for scene in scenes for label in scene.object_labels]
    assert {Truth.TRUE, Truth.FALSE} <= set(occluded)


def test_a_scene_does_not_depend_on_what_came_before(
    engine: SimulationEngine, scenes: list[SimulatedScene]
) -> None:
    again = [engine.scene(0, index) for index in (11, 3, 8)]
    fresh = SimulationEngine(SimulationConfiguration())
    other = [fresh.scene(0, index) for index in (8, 11, 3)]
    fresh.close()
    for position, index in enumerate((11, 3, 8)):
        assert content(again[position]) == content(scenes[index])
    for position, index in enumerate((8, 11, 3)):
        assert content(other[position]) == content(scenes[index])


def test_what_stands_alone_is_labelled_as_the_whole_test_would(
    scenes: list[SimulatedScene],
) -> None:
    world = World()
    for scene in scenes[:6]:
        world.restore((placed.piece, placed.pose) for placed in scene.placed)
        structures = [tuple(label.members) for label in scene.structure_labels]
        again = stability(world, structures, np.random.default_rng(1))
        for label in scene.object_labels:
            assert again[label.name] is label.stable or Truth.AMBIGUOUS in (
                label.stable,
                again[label.name],
            )
    world.close()


def test_seeds_and_indices_give_different_scenes(
    engine: SimulationEngine, scenes: list[SimulatedScene]
) -> None:
    assert content(engine.scene(1, 0)) != content(scenes[0])
    assert content(scenes[0]) != content(scenes[3])


def test_two_engines_do_not_disturb_each_other(scenes: list[SimulatedScene]) -> None:
    one = SimulationEngine(SimulationConfiguration())
    two = SimulationEngine(SimulationConfiguration(arrangement="spread"))
    two.scene(0, 0)
    assert content(one.scene(0, 4)) == content(scenes[4])
    two.close()
    assert content(one.scene(0, 5)) == content(scenes[5])
    one.close()


def test_other_image_sizes_and_views() -> None:
    configuration = SimulationConfiguration(
        arrangement="spread", width=200, height=260, field_of_view_deg=60.0, yaw_deg=180.0
    )
    engine = SimulationEngine(configuration)
    scene = engine.scene(0, 0)
    engine.close()
    assert scene.frame.color.shape == (260, 200, 3)
    table = (scene.frame.instances == 0) & (scene.frame.depth > 0.0)
    heights = points_in_world(scene)[table][:, 2]
    assert np.abs(heights).max() < 1e-5


def test_scenes_travel_between_processes(scenes: list[SimulatedScene]) -> None:
    assert content(pickle.loads(pickle.dumps(scenes[2]))) == content(scenes[2])


def test_images_are_the_same_if_bullet_knows_no_numpy(
    engine: SimulationEngine, scenes: list[SimulatedScene], monkeypatch: pytest.MonkeyPatch
) -> None:
    render = pybullet.getCameraImage

    def flat(**arguments: object) -> list[object]:
        width, height, *images = render(**arguments)
        return [width, height, *(tuple(np.ravel(image).tolist()) for image in images)]

    monkeypatch.setattr(pybullet, "getCameraImage", flat)
    assert content(engine.scene(0, 0)) == content(scenes[0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"arrangement": "pile"}, "'arrangement' is 'pile', must be one of .*towers"),
        ({"width": 10}, "'width' is 10"),
        ({"field_of_view_deg": math.nan}, "'field_of_view_deg'"),
    ],
)
def test_a_wrong_parameter_is_named(change: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        SimulationEngine(dataclasses.replace(SimulationConfiguration(), **change))


def test_impossible_wishes_are_refused() -> None:
    with pytest.raises(SimulationError, match="pitch_min_deg"):
        SimulationEngine(SimulationConfiguration(pitch_min_deg=30.0, pitch_max_deg=20.0))
    engine = SimulationEngine(SimulationConfiguration())
    for seed, index in ((-1, 0), (0, -1)):
        with pytest.raises(SimulationError, match="at least 0"):
            engine.scene(seed, index)
    engine.close()
    engine.close()
    with pytest.raises(SimulationError, match="closed"):
        engine.scene(0, 0)


@pytest.mark.parametrize("stable", [True, False])
def test_a_wish_comes_true(engine: SimulationEngine, stable: bool) -> None:
    wish = Wish(Arrangement.INTERSECTION, stacked=3, stable=stable)
    scene = engine.scene(5, 2, wish)
    assert scene.arrangement == "intersection"
    (stack,) = [label for label in scene.structure_labels if len(label.members) > 1]
    assert len(stack.members) == 3
    assert stack.stable is (Truth.TRUE if stable else Truth.FALSE)
    fresh = SimulationEngine(SimulationConfiguration())
    fresh.scene(0, 1)
    assert content(fresh.scene(5, 2, wish)) == content(scene)
    fresh.close()


def test_an_impossible_wish_is_named(
    engine: SimulationEngine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ros_scenesense.simulation.engine._DRAWS", 20)
    with pytest.raises(SimulationError, match="stacked=9"):
        engine.scene(0, 0, Wish(stacked=9))
