"""The computed table is the one that Bullet's renderer would show, and a window is a cut-out."""

import math
from collections.abc import Iterator

import numpy as np
import pybullet
import pytest

from ros_scenesense.geometry import Pose
from ros_scenesense.simulation.arrangements import Piece
from ros_scenesense.simulation.backgrounds import TABLE_COLOR
from ros_scenesense.simulation.camera import Camera
from ros_scenesense.simulation.catalogue import load_catalogue
from ros_scenesense.simulation.object_files import Color
from ros_scenesense.simulation.table import TABLE_EDGE_M, cast_shadows, table_colors, table_depth
from ros_scenesense.simulation.view import (
    EVEN_LIGHT,
    Light,
    draw_light,
    frame_scene,
    renderer_intrinsics,
)
from ros_scenesense.simulation.world import World

INTRINSICS = renderer_intrinsics(320, 240, 40.0)
CATALOGUE = load_catalogue()


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    world = World(CATALOGUE)
    yield world
    world.close()


def looking(yaw_deg: float = 0.0, roll_deg: float = 0.0, distance: float = 1.1) -> Pose:
    corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 0.2)])
    angles = math.radians(25.0), math.radians(yaw_deg)
    return frame_scene(corners, INTRINSICS, *angles, distance, math.radians(roll_deg))


@pytest.fixture
def rendered(world: World) -> Iterator[int]:
    """A real table of the same size, which Bullet renders."""
    half = [TABLE_EDGE_M / 2.0, TABLE_EDGE_M / 2.0, 0.05]
    shape = pybullet.createVisualShape(
        pybullet.GEOM_BOX,
        halfExtents=half,
        rgbaColor=[*TABLE_COLOR, 1.0],
        physicsClientId=world.client,
    )
    world.clear()
    body = pybullet.createMultiBody(0.0, -1, shape, [0.0, 0.0, -0.05], physicsClientId=world.client)
    yield body
    pybullet.removeBody(body, physicsClientId=world.client)


@pytest.mark.parametrize(
    "pose", [looking(), looking(140.0), looking(-30.0, 20.0), looking(10.0, 0.0, 2.0)]
)
@pytest.mark.parametrize("seed", [0, 1])
def test_it_is_where_and_as_bright_as_the_renderer_would_show_it(
    world: World, rendered: int, pose: Pose, seed: int
) -> None:
    light = draw_light(np.random.default_rng(seed))
    picture = Camera(world, INTRINSICS, shadows=True).picture(pose, light)
    depth = table_depth(INTRINSICS, pose)
    assert np.array_equal(picture.bodies == rendered, depth > 0.0)
    assert np.abs(picture.depth - depth).max() < 1e-5
    shown = picture.color[depth > 0.0].astype(float)
    # The renderer rounds twice.
    assert np.abs(shown - table_colors(light)[0]).max() < 3.0


def test_beside_the_table_there_is_nothing() -> None:
    level = Pose((-3.0, 0.0, 0.4), looking().orientation)
    depth = table_depth(INTRINSICS, level)
    assert 0 < np.count_nonzero(depth) < depth.size / 2
    up = Pose((0.0, 0.0, 0.4), (0.0, 0.0, 0.0, 1.0))  # looks at the ceiling
    assert not table_depth(INTRINSICS, up).any()


def test_a_shadow_lies_where_the_lamp_does_not_shine() -> None:
    # A lamp at 45 degrees on the left: the shadow of the top edge is as far right as it is high.
    light = Light((0.0, 1.0, 1.0), 0.5, 0.4)
    box = np.array([[x, y, z] for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (0.0, 0.1)])
    pose = looking()
    mask = cast_shadows([box], light, INTRINSICS, pose)
    depth = table_depth(INTRINSICS, pose)
    points = INTRINSICS.back_project(depth) @ pose.matrix()[:3, :3].T + pose.matrix()[:3, 3]
    x, y = points[..., 0], points[..., 1]
    # A pixel is up to 6 mm of the table.
    inside = (np.abs(x) < 0.044) & (y > -0.144) & (y < 0.044)
    outside = (np.abs(x) > 0.06) | (y < -0.16) | (y > 0.06)
    assert (mask[inside] == 255).all()
    assert not mask[outside & (depth > 0.0)].any()
    lit, dark = table_colors(light)
    assert (dark < lit).all()


def test_shadows_darken_the_table_alone(world: World) -> None:
    cube = CATALOGUE["large_cube"]
    world.build([Piece(cube, Color.RED, 0.0, 0.0, 0.0)])
    bright, dark = (
        Camera(world, INTRINSICS, shadows).picture(looking(), EVEN_LIGHT)
        for shadows in (False, True)
    )
    darker = (dark.color.astype(int) < bright.color).any(axis=2)
    assert np.count_nonzero(darker & (dark.bodies < 0)) > 100
    assert not (dark.color.astype(int) > bright.color + 1).any()
    assert np.array_equal(bright.depth, dark.depth)


def test_a_window_is_a_part_of_the_whole_picture(world: World) -> None:
    camera = Camera(world, INTRINSICS, shadows=False)
    differences = 0
    for number, item in enumerate(CATALOGUE.values()):
        world.build([Piece(item, item.colors[0], 0.02, 0.03, 0.5)])
        pose = looking(20.0 * number, number - 5.0)
        window = camera.window(pose, world.corners())
        whole, part = camera.bodies(pose), camera.bodies(pose, window=window)
        assert part.shape == whole[window.part].shape
        # All of the object is in the window; rounding moves its outline by hardly a pixel.
        assert np.count_nonzero(whole >= 0) == np.count_nonzero(whole[window.part] >= 0)
        differences += np.count_nonzero(whole[window.part] != part)
    assert differences <= 5


def test_a_window_of_what_is_behind_the_camera_is_everything(world: World) -> None:
    camera = Camera(world, INTRINSICS, shadows=False)
    window = camera.window(looking(), np.array([[-9.0, 0.0, 0.0]]))
    assert (window.left, window.top, window.right, window.bottom) == (0, 0, 320, 240)
