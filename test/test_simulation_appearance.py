"""Textures, backgrounds and light: they change how a scene looks, and nothing else."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Intrinsics, Pose, look_at, rotation_matrix
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.appearance import Appearance, draw_appearance, dress
from ros_scenesense.simulation.backgrounds import (
    MOST_BACKGROUNDS,
    PLAIN,
    TABLE_COLOR,
    background,
    recomposite,
)
from ros_scenesense.simulation.engine import (
    SimulatedScene,
    SimulationConfiguration,
    SimulationEngine,
)
from ros_scenesense.simulation.textures import Pattern, Texture, draw_texture
from ros_scenesense.simulation.view import draw_light, frame_scene, renderer_intrinsics
from ros_scenesense.simulation.world import COLORS

NUMBERS = range(1, 13)


def scenes_of(count: int, **parameters: object) -> list[SimulatedScene]:
    engine = SimulationEngine(SimulationConfiguration(**parameters))
    scenes = [engine.scene(5, index) for index in range(count)]
    engine.close()
    return scenes


@pytest.fixture(scope="module")
def plain() -> list[SimulatedScene]:
    return scenes_of(6, textures=False, backgrounds=0)


@pytest.fixture(scope="module")
def dressed() -> list[SimulatedScene]:
    return scenes_of(6, textures=True, backgrounds=5)


def test_geometry_and_labels_do_not_depend_on_looks(
    plain: list[SimulatedScene], dressed: list[SimulatedScene]
) -> None:
    for one, other in zip(plain, dressed, strict=True):
        assert np.array_equal(one.frame.depth, other.frame.depth)
        assert np.array_equal(one.frame.instances, other.frame.instances)
        assert one.frame.camera_pose == other.frame.camera_pose
        assert one.object_labels == other.object_labels
        assert one.structure_labels == other.structure_labels
        assert one.relations == other.relations
        assert one.hidden == other.hidden
        assert not np.array_equal(one.frame.color, other.frame.color)
        assert (one.background, other.background in range(1, 6)) == (PLAIN, True)
    assert len({scene.background for scene in dressed}) > 1


def test_a_background_is_what_recomposition_makes_of_the_plain_one(
    plain: list[SimulatedScene],
) -> None:
    for one, other in zip(plain, scenes_of(6, textures=False, backgrounds=5), strict=True):
        assert np.array_equal(recomposite(one.frame, other.background), other.frame.color)


def test_objects_keep_their_pixels_and_the_old_background_comes_back(
    dressed: list[SimulatedScene], plain: list[SimulatedScene]
) -> None:
    for number, scene in enumerate(dressed, 1):
        frame = scene.frame
        shown = recomposite(frame, number, scene.background)
        objects = frame.instances > 0
        assert np.array_equal(shown[objects], frame.color[objects])
        back = recomposite(dataclasses.replace(frame, color=shown), PLAIN, number)
        away = np.abs(back.astype(int) - plain[number - 1].frame.color)[~objects]
        assert np.quantile(away, 0.99) <= 4
        assert recomposite(frame, scene.background, scene.background) is frame.color


def test_a_background_lies_still_while_the_camera_moves() -> None:
    camera = Intrinsics(64, 48, 60.0, 60.0, 32.0, 24.0)
    target = np.array([0.1, -0.05, 0.0])

    def seen_from(eye: tuple[float, float, float]) -> np.ndarray:
        pose = look_at(eye, (0.1, -0.05, 0.0))
        color = np.full((48, 64, 3), np.round(255 * np.array(TABLE_COLOR)), dtype=np.uint8)
        depth = np.ones((48, 64), dtype=np.float32)
        nothing = np.zeros((48, 64), dtype=np.uint16)
        shown = recomposite(Frame(0, "camera", color, depth, camera, nothing, pose), 2)
        optical = (target - eye) @ rotation_matrix(pose.orientation)
        u, v = camera.project(optical[None])[0]
        return shown[round(v), round(u)].astype(int)

    first = seen_from((-0.3, 0.0, 0.4))
    for eye in ((0.1, 0.5, 0.3), (0.6, -0.3, 0.5), (0.1, -0.06, 0.4)):
        assert np.abs(seen_from(eye) - first).max() <= 6


def test_the_shadow_stays() -> None:
    (scene,) = scenes_of(1, textures=False, backgrounds=0)
    frame = scene.frame
    table = (frame.instances == 0) & (frame.depth > 0.0)
    darker = frame.color.copy()
    darker[table] //= 2
    before = recomposite(frame, 4)[table].astype(int)
    after = recomposite(dataclasses.replace(frame, color=darker), 4)[table].astype(int)
    assert np.abs(after - before / 2.0).max() <= 3


def test_backgrounds_are_many_dull_and_always_the_same() -> None:
    seen = []
    for number in NUMBERS:
        images = background(number)
        background.cache_clear()
        again = background(number)
        for image, twin in ((images.table, again.table), (images.wall, again.wall)):
            assert np.array_equal(image, twin)
            mean = image.reshape(-1, 3).mean(axis=0)
            assert np.ptp(mean) < 0.45 * mean.max()
            assert image.std(axis=(0, 1)).max() < 60.0
        assert images.table.min() >= 30
        seen.append(images.table.tobytes())
    assert len(set(seen)) == len(seen)


@pytest.mark.parametrize("number", [-1, MOST_BACKGROUNDS + 1])
def test_a_background_that_does_not_exist_is_refused(number: int) -> None:
    with pytest.raises(SimulationError, match=f"background {number}: the numbers are 0 to"):
        background(number)


def test_a_frame_without_pose_or_ids_is_refused(plain: list[SimulatedScene]) -> None:
    for missing in ("instances", "camera_pose"):
        frame = dataclasses.replace(plain[0].frame, **{missing: None})
        with pytest.raises(SimulationError, match="needs instance ids and the camera pose"):
            recomposite(frame, 1)


def test_names_of_colours_stay_true_in_every_texture_and_light() -> None:
    palette = np.array(list(COLORS.values()))
    palette /= np.linalg.norm(palette, axis=1, keepdims=True)
    seen, lit = [], []
    for scene in scenes_of(12, arrangement="spread"):
        for known in scene.objects:
            pixels = scene.frame.color[scene.frame.instances == known.instance].astype(float)
            mean = pixels.mean(axis=0)
            likeness = palette @ (mean / np.linalg.norm(mean))
            seen.append(list(COLORS)[int(np.argmax(likeness))] == known.color)
            lit.append(pixels.max(axis=1).mean())
    assert all(seen)
    assert min(lit) > 60.0


def test_a_texture_belongs_to_its_object_wherever_it_is(plain: list[SimulatedScene]) -> None:
    """Appearance is by name: another object that leaves does not change it."""
    scene = plain[0]
    names = [known.name for known in scene.objects]
    poses = {name: placed.pose for name, placed in zip(names, scene.placed, strict=True)}
    texture = Texture(Pattern.CHECKER, 0.03, 0.5, (0.0, 0.0, 1.0), (0.3, 0.4, 0.5))
    shown = dress(scene.frame, poses, Appearance({names[1]: texture}))
    changed = (shown.color != scene.frame.color).any(axis=2)
    assert set(np.unique(scene.frame.instances[changed]).tolist()) == {2}
    assert np.array_equal(shown.depth, scene.frame.depth)


seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=60, deadline=None)
@given(seed=seeds)
def test_textures_only_darken_and_never_hide_the_colour(seed: int) -> None:
    texture = draw_texture(np.random.default_rng(seed))
    points = np.random.default_rng(seed + 1).uniform(-0.1, 0.1, (500, 3))
    brightness = texture.brightness(points)
    assert brightness.shape == (500,)
    assert (brightness >= 1.0 - texture.depth - 1e-6).all()
    assert (brightness <= 1.0).all()
    assert (
        np.ptp(brightness) == 0.0 if texture.pattern is Pattern.PLAIN else brightness.std() > 0.02
    )
    assert draw_texture(np.random.default_rng(seed)) == texture


def test_all_patterns_and_backgrounds_are_drawn() -> None:
    rng = np.random.default_rng(0)
    drawn = [draw_appearance(["a", "b"], True, 6, rng) for _ in range(60)]
    assert {one.background for one in drawn} == set(range(1, 7))
    assert {texture.pattern for one in drawn for texture in one.textures.values()} == set(Pattern)
    assert draw_appearance(["a"], False, 0, rng) == Appearance()


def test_light_varies_within_bounds() -> None:
    lights = [draw_light(np.random.default_rng(seed)) for seed in range(50)]
    for light in lights:
        assert math.isclose(np.linalg.norm(light.direction), 1.0)
        assert light.direction[2] > 0.6
        assert 0.75 < light.ambient + light.diffuse < 1.2
        assert max(light.color) / min(light.color) < 1.2
    assert np.std([light.direction[1] for light in lights]) > 0.2
    assert np.std([light.color[0] for light in lights]) > 0.02


def test_a_rolled_camera_still_sees_everything() -> None:
    camera = renderer_intrinsics(160, 120, 40.0)
    corners = np.random.default_rng(0).uniform(-0.2, 0.2, (30, 3))
    corners[:, 2] += 0.2
    for roll_deg in (-20.0, 5.0, 20.0):
        roll = math.radians(roll_deg)
        pose: Pose = frame_scene(corners, camera, 0.4, 0.3, 1.0, roll)
        rotation = rotation_matrix(pose.orientation)
        assert math.isclose(math.asin(rotation[2, 0] / math.cos(0.4)), -roll, abs_tol=1e-9)
        pixels = camera.project((corners - pose.position) @ rotation)
        assert (pixels >= 0.0).all()
        assert (pixels <= [159.0, 119.0]).all()
