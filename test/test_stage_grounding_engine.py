"""The grounding engine on rendered blocks: what is where, and what cannot be known."""

import dataclasses
import math

import msgspec
import numpy as np
import pytest
from box_scenes import Block, render, scene_of

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Intrinsics, Pose, look_at, transform_points
from ros_scenesense.grounding.memory import GroundingMemory
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.grounding import (
    Grounding,
    Groundings,
    MsrSample,
    Objects,
    PairGrounding,
)
from ros_scenesense.messages.scenes import KnownObject
from ros_scenesense.parameters import build
from ros_scenesense.scene import Distance, NamingFrame, Position, Size, Surface
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.stages.grounding_engine import (
    GroundingConfiguration,
    GroundingEngine,
    GroundingResult,
)
from ros_scenesense.stages.pair_grounding import Learned

CAMERA = look_at((-0.8, 0.0, 0.45), (0.0, 0.0, 0.05))  # looks along x: right is -y in the world
LARGER = Intrinsics(width=320, height=240, fx=330.0, fy=330.0, cx=160.0, cy=119.0)
MIDDLE = Block("middle", (0.0, 0.0, 0.0))
AROUND = [
    MIDDLE,
    Block("right", (0.0, -0.15, 0.0)),
    Block("left", (0.0, 0.15, 0.0)),
    Block("front", (-0.2, 0.0, 0.0), (0.05, 0.05, 0.05)),
    Block("behind", (0.25, 0.0, 0.0), (0.08, 0.08, 0.15)),
    Block("above", (0.01, 0.01, 0.08), (0.05, 0.05, 0.05)),
]


def engine(**values) -> GroundingEngine:
    return GroundingEngine(build(GroundingConfiguration, values))


def said(result: GroundingResult) -> dict:
    return {(pair.object, pair.reference): pair.qsr for pair in result.groundings.pairs}


def test_names_blocks_around_a_block():
    result = engine().ground(render(AROUND), scene_of(AROUND))
    relations = said(result)
    assert result.groundings.naming_frame is NamingFrame.VIEWER
    assert result.problems == []
    assert len(relations) == 6 * 5
    for name in ("right", "left", "front", "behind", "above"):
        assert relations[name, "middle"].position == name
        assert relations["middle", name].position is Position(name).converse
        touches = Distance.TOUCHING if name == "above" else Distance.NOT_TOUCHING
        assert relations[name, "middle"].distance is touches


@pytest.mark.parametrize("instances", ["given", "own"])
def test_a_third_of_the_readings_missing_changes_no_relation(instances):
    frame = render(AROUND, intrinsics=LARGER)
    frame.color[...] = np.random.default_rng(1).integers(40, 220, (7, 3))[frame.instances]
    depth = frame.depth.copy()
    depth[np.random.default_rng(0).random(depth.shape) < 0.3] = np.nan
    scene = scene_of(AROUND if instances == "given" else [])
    whole = said(engine(instances=instances).ground(frame, scene))
    holed = dataclasses.replace(frame, depth=depth)
    found = said(engine(instances=instances).ground(holed, scene))
    assert len(whole) == 6 * 5
    assert {pair: one.position for pair, one in found.items()} == {
        pair: one.position for pair, one in whole.items()
    }


def test_in_simulated_towers_everything_is_on_its_support():
    simulation = SimulationEngine(build(SimulationConfiguration, {"arrangement": "towers"}))
    supports = 0
    for index in range(6):
        simulated = simulation.scene(0, index)
        scene = msgspec.structs.replace(scene_of([]), objects=simulated.objects)
        relations = said(engine().ground(simulated.frame, scene))
        for upper, lower in simulated.supports:
            supports += 1
            assert relations[upper, lower].position is Position.ABOVE
            assert relations[upper, lower].distance is Distance.TOUCHING
    simulation.close()
    assert supports > 6


def test_far_objects_are_far():
    blocks = [Block("a", (0.0, 0.0, 0.0)), Block("b", (1.5, 0.0, 0.0), (0.3, 0.3, 0.6))]
    relations = said(engine().ground(render(blocks), scene_of(blocks)))
    assert relations["b", "a"].distance is Distance.FAR
    assert relations["b", "a"].position is Position.BEHIND


def test_a_stack_touches_though_an_overhang_hides_the_contact():
    lower = Block("lower", (0.0, 0.0, 0.0), (0.08, 0.08, 0.06))
    upper = Block("upper", (-0.04, 0.0, 0.06), (0.08, 0.08, 0.06))
    relation = said(engine().ground(render([lower, upper]), scene_of([lower, upper])))
    assert relation["upper", "lower"].position is Position.ABOVE
    assert relation["upper", "lower"].distance is Distance.TOUCHING


def test_boxes_lie_around_the_visible_surface_in_the_optical_frame():
    result = engine().ground(render(AROUND), scene_of(AROUND))
    by_name = {one.name: one for one in result.objects.objects}
    corners = transform_points(CAMERA.matrix(), by_name["above"].box.corners())
    # Front, sides and top of the block are found, but for 3 % at each end and half a pixel (3 mm);
    # its back cannot be seen.
    assert corners[:, 0].min() == pytest.approx(-0.015, abs=0.006)
    assert corners[:, 1].min() == pytest.approx(-0.015, abs=0.006)
    assert corners[:, 1].max() == pytest.approx(0.035, abs=0.006)
    assert corners[:, 2].max() == pytest.approx(0.13, abs=0.006)
    assert result.objects.frame_id == "camera_color_optical_frame"


def test_the_camera_frame_names_along_the_optical_axes():
    steep = look_at((-0.1, 0.0, 1.0), (0.0, 0.0, 0.0))
    blocks = [Block("near", (-0.2, 0.0, 0.0)), Block("tall", (0.0, 0.0, 0.0))]
    frame = render(blocks, camera=steep)
    by_gravity = engine().ground(frame, scene_of(blocks))
    by_camera = engine(frame="camera").ground(frame, scene_of(blocks))
    assert said(by_gravity)["near", "tall"].position is Position.FRONT
    assert by_camera.groundings.naming_frame is NamingFrame.CAMERA
    # Seen from above, what is nearer the viewer is lower in the image.
    assert said(by_camera)["near", "tall"].position is Position.BELOW


def test_without_a_table_gravity_comes_from_the_pose_and_it_is_said():
    frame = render(AROUND, table=False)
    result = engine().ground(frame, scene_of(AROUND, pose=CAMERA))
    assert result.groundings.naming_frame is NamingFrame.VIEWER
    assert said(result)["above", "middle"].position is Position.ABOVE
    ((kind, words),) = result.problems
    assert (kind, "s-0000" in words) == ("naming_frame", True)
    in_frame = dataclasses.replace(frame, camera_pose=CAMERA)
    assert engine().ground(in_frame, scene_of(AROUND)).groundings == result.groundings


def test_without_a_table_and_pose_the_cameras_axes_serve_and_it_is_said():
    result = engine().ground(render(AROUND, table=False), scene_of(AROUND))
    assert result.groundings.naming_frame is NamingFrame.CAMERA
    assert "camera pose is unknown" in result.problems[0][1]


def test_given_attributes_are_kept_and_others_are_measured():
    scene = scene_of([MIDDLE])
    given = KnownObject(
        instance=1,
        name="middle",
        size=Size.LARGE,
        surface=Surface.FLAT,
        shape="cube",
        color="red",
    )
    scene = msgspec.structs.replace(scene, objects=[given])
    (one,) = engine().ground(render([MIDDLE]), scene).objects.objects
    assert (one.size.value, one.size.source) == (Size.LARGE, "given")
    assert (one.surface.value, one.shape.value, one.color.value) == (Surface.FLAT, "cube", "red")
    (bare,) = engine().ground(render([MIDDLE]), scene_of([MIDDLE])).objects.objects
    measured = (bare.size, bare.surface, bare.shape, bare.color)
    assert [one.value for one in measured] == [Size.MEDIUM, Surface.FLAT, "box", "grey"]
    assert {one.source for one in measured} == {"measured"}


def test_each_attribute_that_is_not_given_is_measured():
    given = KnownObject(instance=1, name="middle", color="red")
    scene = msgspec.structs.replace(scene_of([MIDDLE]), objects=[given])
    (one,) = engine().ground(render([MIDDLE]), scene).objects.objects
    assert (one.color.value, one.color.source) == ("red", "given")
    assert (one.shape.value, one.shape.source) == ("box", "measured")


def test_of_an_object_that_another_hides_only_the_colour_is_measured():
    hidden, before = MIDDLE, Block("before", (-0.2, 0.03, 0.0))
    listed = engine().ground(render([hidden, before]), scene_of([hidden, before])).objects.objects
    assert (listed[0].size, listed[0].surface, listed[0].shape) == (None, None, None)
    assert listed[0].color.value == "grey"
    assert listed[1].shape.value == "box"


def test_a_hidden_object_is_listed_but_not_located():
    wall = Block("wall", (-0.1, 0.0, 0.0), (0.02, 0.3, 0.3))
    hidden = Block("hidden", (0.1, 0.0, 0.0), (0.05, 0.05, 0.05))
    side = Block("side", (0.0, 0.3, 0.0))
    blocks = [wall, hidden, side]
    result = engine().ground(render(blocks), scene_of(blocks))
    by_name = {one.name: one for one in result.objects.objects}
    assert (by_name["hidden"].points, by_name["hidden"].box) == (0, None)
    assert set(said(result)) == {("wall", "side"), ("side", "wall")}


def test_an_object_with_too_few_readings_is_not_located():
    frame = render([MIDDLE, Block("right", (0.0, -0.15, 0.0))])
    pixels = np.flatnonzero(frame.instances == 2)
    depth = frame.depth.copy()
    depth.reshape(-1)[pixels[19:]] = 0.0
    holes = dataclasses.replace(frame, depth=depth)
    scene = scene_of([MIDDLE, Block("right", (0.0, -0.15, 0.0))])
    located = {
        limit: engine(min_points=limit).ground(holes, scene).objects.objects[1]
        for limit in (19, 20)
    }
    assert (located[19].points, located[20].points) == (19, 19)
    assert located[19].box is not None
    assert located[20].box is None
    assert engine().ground(holes, scene).groundings.pairs == []


def test_instance_ids_that_the_scene_does_not_name_are_objects():
    scene = scene_of(AROUND[:2])
    renamed = msgspec.structs.replace(
        scene, objects=[*scene.objects[:1], KnownObject(instance=2, name="object_3")]
    )
    result = engine().ground(render(AROUND[:3]), renamed)
    names = [one.name for one in result.objects.objects]
    assert names == ["middle", "object_3", "object_3_"]
    assert said(result)["object_3_", "middle"].position is Position.LEFT


def test_an_empty_scene_gives_empty_messages():
    result = engine().ground(render([]), scene_of([]))
    assert (result.groundings.pairs, result.objects.objects, result.problems) == ([], [], [])


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, -1.0])
def test_an_empty_depth_image_locates_nothing_and_it_is_said(value):
    frame = dataclasses.replace(render(AROUND), depth=np.full((120, 160), value, np.float32))
    result = engine().ground(frame, scene_of(AROUND))
    assert result.groundings.pairs == []
    assert [one.box for one in result.objects.objects] == [None] * 6
    assert [kind for kind, _ in result.problems] == ["empty_depth"]


@pytest.mark.parametrize("depth", ["holes", "noise", "huge", "tiny"])
def test_whatever_depth_says_the_messages_are_proper(depth):
    frame = render(AROUND)
    rng = np.random.default_rng(0)
    images = {
        "holes": np.where(rng.random(frame.depth.shape) < 0.3, np.nan, frame.depth),
        "noise": rng.random(frame.depth.shape) * 3.0,
        "huge": np.full_like(frame.depth, 3e38),
        "tiny": np.full_like(frame.depth, 1e-38),
    }
    frame = dataclasses.replace(frame, depth=images[depth].astype(np.float32))
    result = engine().ground(frame, scene_of(AROUND))
    assert decode(encode(result.groundings), Groundings) == result.groundings
    assert decode(encode(result.objects), Objects) == result.objects
    if depth == "holes":
        assert said(result)["above", "middle"].position is Position.ABOVE


def test_one_object_that_fills_the_image_is_located_alone():
    frame = dataclasses.replace(render([]), instances=np.ones((120, 160), np.uint16))
    result = engine().ground(frame, scene_of([MIDDLE]))
    assert result.objects.objects[0].box is not None
    assert (result.groundings.pairs, result.problems) == ([], [])


def test_same_seed_same_result_whatever_came_before():
    one = engine(points_per_object=50)
    first = one.ground(render(AROUND), scene_of(AROUND))
    one.ground(render(AROUND[:3]), scene_of(AROUND[:3]))
    again = one.ground(render(AROUND), scene_of(AROUND))
    assert (again.groundings, again.objects) == (first.groundings, first.objects)
    other = engine(points_per_object=50, seed=1).ground(render(AROUND), scene_of(AROUND))
    assert other.objects != first.objects


def test_the_largest_scene_with_the_longest_names_fits_its_topics():
    instances = np.repeat(np.arange(1, 41, dtype=np.uint16), 480).reshape(120, 160)
    frame = dataclasses.replace(render([]), instances=instances)
    # JSON writes a control character in six bytes: no names are longer.
    scene = scene_of([Block("\x01" * 62 + f"{i:02d}", (0, 0, 0)) for i in range(40)])
    result = engine().ground(frame, scene)
    assert len(result.groundings.pairs) == 40 * 39
    encode(result.groundings)
    encode(result.objects)


def test_steps_are_timed():
    timings = engine().ground(render(AROUND), scene_of(AROUND)).timings
    steps = {timing.name: timing.milliseconds for timing in timings}
    total = steps.pop("grounding/total")
    assert set(steps) == {"grounding/clouds", "grounding/naming_frame", "grounding/relations"}
    assert total == pytest.approx(sum(steps.values()))


def test_cloud_has_the_stamp_of_the_frame():
    cloud = engine(cloud_voxel_m=0.0).cloud(render(AROUND, stamp_ns=5))
    assert (cloud.stamp_ns, cloud.frame_id) == (5, "camera_color_optical_frame")
    assert len(cloud.points) == np.count_nonzero(render(AROUND).depth)


def test_a_frame_without_instances_is_an_error():
    frame = dataclasses.replace(render(AROUND), instances=None)
    with pytest.raises(FrameError, match="camera/instances"):
        engine().ground(frame, scene_of(AROUND))


def taught() -> GroundingMemory:
    """What is learned from a scene of blocks around a block, all named by the QSR."""
    memory = GroundingMemory()
    result = engine().ground(render(AROUND), scene_of(AROUND))
    for (object, reference), grounding in said(result).items():
        for relation in (grounding.position, grounding.distance):
            lesson = MsrSample(
                scene_id="s-0000",
                object=object,
                reference=reference,
                relation=relation.value,
                source="qsr",
            )
            memory.learn([result.record.example(lesson)])
    return memory


def test_what_was_learned_grounds_every_pair_beside_the_fixed_model():
    before = engine().ground(render(AROUND), scene_of(AROUND))
    assert {pair.msr for pair in before.groundings.pairs} == {None}
    assert before.groundings.applied_update == 0
    learned = Learned(taught(), applied=7)
    after = engine().ground(render(AROUND), scene_of(AROUND), learned)
    assert after.groundings.applied_update == 7
    agree = [
        pair.qsr.position is pair.msr.position and pair.qsr.distance is pair.msr.distance
        for pair in after.groundings.pairs
        if pair.object == "middle" or pair.reference == "middle"
    ]
    assert agree == [True] * 10
    assert all(0.5 <= pair.msr.position_confidence <= 1.0 for pair in after.groundings.pairs)
    assert [pair.qsr for pair in after.groundings.pairs] == list(said(before).values())


def test_what_is_learned_counts_before_a_scene_without_depth_too():
    frame = dataclasses.replace(render(AROUND), depth=np.zeros((120, 160), np.float32))
    result = engine().ground(frame, scene_of(AROUND), Learned(GroundingMemory(), applied=3))
    assert result.groundings.applied_update == 3
    assert result.record is None


def seen_from(yaw_deg: float) -> Pose:
    """A camera that looks at the middle, turned about it to the left by an angle."""
    yaw = math.radians(yaw_deg)
    return look_at((-0.8 * math.cos(yaw), -0.8 * math.sin(yaw), 0.45), (0.0, 0.0, 0.05))


@pytest.mark.parametrize("yaw_deg", [0.0, 40.0, -40.0, 90.0])
def test_left_and_right_of_the_robot_stay_when_the_camera_moves(yaw_deg):
    pose = seen_from(yaw_deg)
    frame, scene = render(AROUND, camera=pose), scene_of(AROUND, pose=pose)
    by_robot = engine(naming_frame="robot").ground(frame, scene)
    by_viewer = engine().ground(frame, scene)
    assert by_robot.groundings.naming_frame is NamingFrame.ROBOT
    turned = math.degrees(by_robot.groundings.viewpoint_yaw) + yaw_deg
    assert math.remainder(turned, 360.0) == pytest.approx(0.0, abs=2.0)
    for name in ("right", "left", "front", "behind", "above"):
        assert said(by_robot)[name, "middle"].position == name
    for pair in by_robot.groundings.pairs:
        viewed = said(by_viewer)[pair.object, pair.reference]
        assert pair.viewer_position is viewed.position
        assert pair.qsr.distance is viewed.distance
    assert {pair.viewer_position for pair in by_viewer.groundings.pairs} == {None}


def test_the_robots_directions_need_the_camera_pose_and_it_is_said():
    result = engine(naming_frame="robot").ground(render(AROUND), scene_of(AROUND))
    assert result.groundings.naming_frame is NamingFrame.VIEWER
    ((kind, words),) = result.problems
    assert kind == "naming_frame"
    assert "publish camera_pose in scene" in words


def test_axes_that_peoples_words_turned_name_the_relations():
    pose = seen_from(40.0)
    memory = GroundingMemory()
    memory.viewpoint.yaw_rad = math.radians(-40.0)
    result = engine().ground(render(AROUND, camera=pose), scene_of(AROUND), Learned(memory))
    assert result.groundings.naming_frame is NamingFrame.ROBOT
    assert result.groundings.viewpoint_yaw == pytest.approx(math.radians(-40.0))
    for name in ("right", "left", "front", "behind", "above"):
        assert said(result)[name, "middle"].position == name


def test_the_largest_groundings_of_both_models_fit_their_topic():
    # JSON writes a control character in six bytes: no names are longer.
    names = ["\x01" * 62 + f"{number:02d}" for number in range(40)]
    longest = Grounding(
        position=Position.BEHIND,
        position_confidence=0.12345678901234567,
        distance=Distance.NOT_TOUCHING,
        distance_confidence=0.12345678901234567,
    )
    pairs = [
        PairGrounding(
            object=first,
            reference=second,
            qsr=longest,
            msr=longest,
            viewer_position=Position.BEHIND,
        )
        for first in names
        for second in names
        if first != second
    ]
    encode(
        Groundings(
            stamp=Stamp.of(2**60),
            scene_id="\x01" * 128,
            naming_frame=NamingFrame.VIEWER,
            pairs=pairs,
            viewpoint_yaw=0.12345678901234567,
            applied_update=2**53 - 1,
        )
    )
