"""The grounding stage: joining, repeats, refusals, failures; jobs run inline."""

import dataclasses
import re

import msgspec
import numpy as np
import pytest
from box_scenes import Block, render, scene_of

from ros_scenesense.errors import ParameterError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Groundings, Objects, Trust
from ros_scenesense.messages.scenes import KnownObject, Scene
from ros_scenesense.parameters import build
from ros_scenesense.scene import Frame, NamingFrame, Position
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.protocol import Cloud, JobFailure, Segmentation, Timing
from ros_scenesense.stages.worker import InlineRunner

SECOND = 1_000_000_000
BLOCKS = [Block("middle", (0.0, 0.0, 0.0)), Block("right", (0.0, -0.15, 0.0))]


def stage_with(**values) -> GroundingStage:
    return GroundingStage(build(GroundingConfiguration, values))


def run_jobs(stage: GroundingStage, now_ns: int = SECOND) -> list:
    """Runs what the stage wants done; returns what it then publishes."""
    published: list = []
    runner = InlineRunner(
        stage.engine(), lambda job, result: published.extend(stage.finish(job, result, now_ns))
    )
    for job in stage.jobs():
        runner.submit(job)
    runner.close()
    return published


def show(stage: GroundingStage, *items: Frame | Scene, now_ns: int = SECOND) -> list:
    """Gives items to the stage; returns what it publishes, jobs included."""
    published = []
    for item in items:
        published += stage.handle(item, now_ns)
    return published + run_jobs(stage, now_ns)


def problems(stage: GroundingStage) -> list[str]:
    return [kind for kind, _ in stage.health.take_problems()]


def kinds(published: list) -> list[type]:
    return [type(item) for item in published if not isinstance(item, Timing)]


def frame_at(stamp_ns: int = 0) -> Frame:
    return render(BLOCKS, stamp_ns=stamp_ns)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["frame first", "scene first"])
def test_a_scene_and_its_frame_become_objects_groundings_and_segmentation(order):
    stage = stage_with()
    assert stage.start(0) == []
    items = (frame_at(3 * SECOND), scene_of(BLOCKS, stamp_ns=3 * SECOND))
    published = show(stage, *(items[index] for index in order))
    assert kinds(published) == [Objects, Groundings, Segmentation]
    objects, groundings, segmentation = published[:3]
    assert objects.scene_id == groundings.scene_id == "s-0000"
    assert objects.stamp == groundings.stamp == Stamp.of(3 * SECOND)
    assert groundings.pairs[1].qsr.position is Position.RIGHT
    assert (segmentation.stamp_ns, segmentation.frame_id) == (3 * SECOND, objects.frame_id)
    np.testing.assert_array_equal(segmentation.instances, items[0].instances)
    assert {item.name for item in published if isinstance(item, Timing)} >= {"grounding/total"}
    assert problems(stage) == []


def test_scenes_out_of_order_find_their_own_frames():
    stage = stage_with()
    frames = {stamp: frame_at(stamp) for stamp in (1, 2)}
    scenes = {stamp: scene_of(BLOCKS, stamp_ns=stamp, scene_id=f"s-{stamp}") for stamp in (1, 2)}
    published = show(stage, frames[1], scenes[2], frames[2], scenes[1])
    found = [(one.scene_id, one.stamp.nanoseconds) for one in published if type(one) is Groundings]
    assert found == [("s-2", 2), ("s-1", 1)]


@pytest.mark.parametrize(
    ("stamp_ns", "published"), [(0, [Segmentation]), (9, [])], ids=["same stamp", "new stamp"]
)
def test_a_scene_that_is_finished_is_not_grounded_again(stamp_ns, published):
    stage = stage_with(join_timeout_s=1.0)
    assert show(stage, frame_at(), scene_of(BLOCKS))
    again = (frame_at(stamp_ns), scene_of(BLOCKS, stamp_ns=stamp_ns))
    assert kinds(show(stage, *again)) == published
    assert stage.health.counters["repeated"] >= 1
    assert stage.tick(100 * SECOND) == []
    assert problems(stage) == []


def test_the_segmentation_of_a_frame_that_is_shown_again_is_published_again():
    stage = stage_with()
    published = show(stage, frame_at(), scene_of(BLOCKS))
    first = published[kinds(published).index(Segmentation)]
    assert stage.handle(scene_of(BLOCKS), SECOND) == []
    assert stage.handle(frame_at(), SECOND) == [first]
    for number in range(1, 20):  # only the newest are kept
        other = scene_of(BLOCKS, stamp_ns=number, scene_id=f"s-{number:04d}")
        show(stage, frame_at(number), other)
    assert stage.handle(frame_at(), SECOND) == []


def test_a_scene_shown_again_while_it_is_grounded_is_grounded_once():
    stage = stage_with()
    items = (frame_at(), scene_of(BLOCKS))
    for item in items + items:
        stage.handle(item, SECOND)
    assert len(stage.jobs()) == 1
    assert stage.jobs() == []


@pytest.mark.parametrize(
    ("item", "kind", "named"),
    [
        (frame_at(5 * SECOND + 7), "scene_missing", "publish a scene message"),
        (scene_of(BLOCKS, stamp_ns=5 * SECOND + 7), "frame_missing", "instance ids"),
    ],
    ids=["scene", "frame"],
)
def test_what_waits_in_vain_is_given_up_and_what_is_missing_is_said(item, kind, named):
    stage = stage_with(join_timeout_s=2.0)
    stage.handle(item, 10 * SECOND)
    stage.tick(12 * SECOND)
    assert problems(stage) == []
    stage.tick(12 * SECOND + 1)
    ((found, words),) = stage.health.take_problems()
    assert found == kind
    assert named in words
    assert "5.000000007 waited 2 s" in words


def test_a_stream_without_scenes_warns_once_until_one_is_complete():
    stage = stage_with(join_timeout_s=1.0)
    for stamp in range(1, 50):
        stage.handle(frame_at(stamp), stamp * SECOND)
        stage.tick(stamp * SECOND)
    assert problems(stage) == ["scene_missing"]
    assert stage.health.counters["scene_missing"] > 40
    assert show(stage, frame_at(60), scene_of(BLOCKS, stamp_ns=60), now_ns=60 * SECOND)
    stage.handle(frame_at(61), 61 * SECOND)
    stage.tick(63 * SECOND)
    assert problems(stage) == ["scene_missing"]


def test_a_scene_given_up_is_grounded_when_it_is_shown_again():
    stage = stage_with(join_timeout_s=1.0)
    stage.handle(scene_of(BLOCKS), SECOND)
    stage.tick(5 * SECOND)
    assert show(stage, frame_at(), scene_of(BLOCKS))


def test_a_frame_without_instances_is_refused_and_may_come_again_with_them():
    stage = stage_with(join_timeout_s=1.0)
    bare = dataclasses.replace(frame_at(), instances=None)
    assert show(stage, scene_of(BLOCKS), bare, bare) == []
    ((kind, words),) = stage.health.take_problems()
    assert kind == "instances_missing"
    assert "camera/instances" in words
    assert kinds(show(stage, frame_at())) == [Objects, Groundings, Segmentation]


def test_a_scene_whose_frame_was_refused_is_given_up_without_a_second_warning():
    stage = stage_with(join_timeout_s=1.0)
    show(stage, scene_of(BLOCKS), dataclasses.replace(frame_at(), instances=None))
    stage.tick(9 * SECOND)
    assert problems(stage) == ["instances_missing"]
    assert stage.health.counters["frame_missing"] == 1


def known(instance: int, name: str) -> KnownObject:
    return KnownObject(instance=instance, name=name)


@pytest.mark.parametrize(
    ("objects", "words"),
    [
        ([known(1, "cup"), known(1, "box")], "instance id 1 is given twice, again to 'box'"),
        ([known(1, "cup"), known(2, "cup")], "the name 'cup' is given twice"),
        ([known(0, "cup")], "'cup' has instance id 0"),
        ([known(65536, "cup")], "'cup' has instance id 65536"),
        ([known(n, f"o{n}") for n in range(1, 12)], "11 objects .* max_objects is 10"),
    ],
    ids=["instance twice", "name twice", "background", "no such id", "too many"],
)
def test_a_scene_whose_objects_cannot_be_told_apart_is_refused(objects, words):
    stage = stage_with(max_objects=10)
    scene = msgspec.structs.replace(scene_of([]), objects=objects)
    assert show(stage, frame_at(), scene) == []
    ((kind, said),) = stage.health.take_problems()
    assert kind == "scene_refused"
    assert said.startswith("scene s-0000: ")
    assert re.search(words, said)
    assert show(stage, scene, frame_at()) == []
    assert problems(stage) == []


def test_unnamed_instances_count_as_objects():
    stage = stage_with(max_objects=1)
    assert show(stage, frame_at(), scene_of([])) == []
    assert problems(stage) == ["scene_refused"]


def test_an_empty_scene_is_published_empty():
    stage = stage_with()
    objects, groundings, *_ = show(stage, render([]), scene_of([]))
    assert (objects.objects, groundings.pairs) == ([], [])
    assert problems(stage) == []


def test_an_empty_depth_image_locates_nothing_but_the_scene_goes_on():
    stage = stage_with()
    frame = dataclasses.replace(frame_at(), depth=np.zeros((120, 160), np.float32))
    objects, groundings, segmentation, *_ = show(stage, frame, scene_of(BLOCKS))
    assert [one.box for one in objects.objects] == [None, None]
    assert groundings.pairs == []
    assert segmentation.instances.any()
    assert problems(stage) == ["empty_depth"]
    assert stage.health.counters["objects_not_located"] == 2


@pytest.mark.parametrize(
    ("frame", "naming"), [("gravity", NamingFrame.VIEWER), ("camera", NamingFrame.CAMERA)]
)
def test_a_failed_job_locates_nothing_but_the_scene_goes_on(frame, naming):
    stage = stage_with(frame=frame)
    for item in (frame_at(), scene_of(BLOCKS)):
        stage.handle(item, SECOND)
    (job,) = stage.jobs()
    published = stage.finish(job, JobFailure("stopped after 10 s", timed_out=True), SECOND)
    assert kinds(published) == [Objects, Groundings, Segmentation]
    assert [one.name for one in published[0].objects] == ["middle", "right"]
    assert [one.box for one in published[0].objects] == [None, None]
    assert published[1].naming_frame is naming
    ((kind, words),) = stage.health.take_problems()
    assert kind == "grounding_failed"
    assert "s-0000" in words
    assert "stopped after 10 s" in words


def test_a_scene_that_is_dropped_is_counted_and_grounded_when_it_is_shown_again():
    stage = stage_with()
    for item in (frame_at(), scene_of(BLOCKS)):
        stage.handle(item, SECOND)
    (job,) = stage.jobs()
    assert job.droppable
    assert stage.finish(job, JobFailure("32 newer jobs wait", dropped=True), SECOND) == []
    assert problems(stage) == ["scenes_dropped"]
    assert kinds(show(stage, frame_at(), scene_of(BLOCKS))) == [Objects, Groundings, Segmentation]


def test_the_cloud_is_made_while_somebody_wants_it():
    stage = stage_with()
    stage.cloud_wanted = True
    published = show(stage, frame_at(4), scene_of(BLOCKS, stamp_ns=4))
    assert kinds(published) == [Objects, Groundings, Segmentation, Cloud]
    assert published[-1].stamp_ns == 4
    stage.cloud_wanted = False
    assert Cloud not in kinds(show(stage, frame_at(5), scene_of(BLOCKS, stamp_ns=5, scene_id="t")))


def test_a_failed_cloud_is_a_problem_and_nothing_else():
    stage = stage_with()
    stage.cloud_wanted = True
    for item in (frame_at(), scene_of(BLOCKS)):
        stage.handle(item, SECOND)
    _, job = stage.jobs()
    assert stage.finish(job, JobFailure("out of memory"), SECOND) == []
    assert problems(stage) == ["cloud_failed"]


def test_the_deadline_of_the_configuration_is_the_jobs():
    stage = stage_with(job_deadline_s=3)
    for item in (frame_at(), scene_of(BLOCKS)):
        stage.handle(item, SECOND)
    assert [job.deadline_s for job in stage.jobs()] == [3.0]


def test_other_messages_are_none_of_its_business():
    stage = stage_with()
    trust = Trust(stamp=Stamp.of(0), revision=0, qsr=0.9, msr=0.1, feedback_count=0)
    assert stage.handle(trust, SECOND) == []
    stage.close()
    assert not stage.health.counters


def test_many_scenes_do_not_grow_memory():
    stage = stage_with()
    empty = render([])
    for number in range(1, 2200):
        stage.handle(dataclasses.replace(empty, stamp_ns=number), SECOND)
        stage.handle(scene_of([], stamp_ns=number, scene_id=f"s-{number}"), SECOND)
        stage.jobs()
    remembered = [value for value in vars(stage).values() if hasattr(value, "__len__")]
    assert max(len(value) for value in remembered) <= 2000


@pytest.mark.parametrize(
    "values",
    [
        {"frame": "world"},
        {"max_objects": 41},
        {"min_points": 0},
        {"cloud_voxel_m": -1.0},
        {"job_deadline_s": 0.0},
    ],
    ids=str,
)
def test_parameters_out_of_range_are_refused(values):
    with pytest.raises(ParameterError, match=next(iter(values))):
        stage_with(**values)
