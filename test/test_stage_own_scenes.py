"""Scenes of a camera that announces none: which frames are taken, and ids that are never reused."""

import dataclasses

import numpy as np
import pytest
from box_scenes import Block, render, scene_of

from ros_scenesense.errors import StateError
from ros_scenesense.messages.grounding import Groundings, Objects
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.parameters import build
from ros_scenesense.scene import Frame
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.own_scenes import OwnScenes, SceneNumbers
from ros_scenesense.stages.protocol import Segmentation, Timing
from ros_scenesense.stages.worker import InlineRunner

SECOND = 1_000_000_000
BLOCKS = [Block("one", (0.0, 0.1, 0.0)), Block("two", (0.0, -0.15, 0.0))]
FRAME = render(BLOCKS)
BARE = dataclasses.replace(FRAME, instances=None)


def frame_at(seconds: float, frame: Frame = BARE) -> Frame:
    return dataclasses.replace(frame, stamp_ns=round(seconds * SECOND))


def numbers(folder="", session="") -> SceneNumbers:
    return SceneNumbers(str(folder), session, Health())


class TestNumbers:
    def test_a_session_is_continued_after_a_restart(self, tmp_path):
        first = numbers(tmp_path, "lab")
        assert [first.next_id() for _ in range(3)] == ["lab-0000", "lab-0001", "lab-0002"]
        # Not closed: as after a kill.
        assert numbers(tmp_path, "lab").next_id() == "lab-0003"
        assert numbers(tmp_path, "other").next_id() == "other-0000"
        assert numbers(tmp_path, "lab").next_id() == "lab-0004"

    def test_sessions_without_name_or_memory_never_meet(self, tmp_path):
        made = [numbers(tmp_path), numbers(tmp_path), numbers("", "lab"), numbers("", "lab")]
        assert len({each.next_id() for each in made}) == 4
        assert made[3].session.startswith("lab-")

    def test_a_folder_that_cannot_be_written_is_an_error(self, tmp_path):
        (tmp_path / "file").write_text("")
        with pytest.raises(StateError):
            numbers(tmp_path / "file")


def own_scenes(rate_hz=0.0) -> tuple[OwnScenes, Health]:
    health = Health()
    return OwnScenes(SceneNumbers("", "s", health), rate_hz, 10.0, health), health


class TestChoice:
    def test_at_a_rate_the_latest_frame_is_taken_and_the_others_are_counted(self):
        own, health = own_scenes(rate_hz=2.0)
        taken = []
        for tenth in range(20):
            now = 100 * SECOND + tenth * SECOND // 10
            own.offer(frame_at(tenth / 10), now)
            taken.append(own.take(now))
        stamps = [each[0].stamp_ns / SECOND for each in taken if each]
        assert stamps == [0.0, 0.5, 1.0, 1.5]
        assert [each[1].stamp.nanoseconds / SECOND for each in taken if each] == stamps
        assert health.counters["scenes_minted"] == 4
        assert health.counters["frames_passed_over"] == 16 - 1  # the newest is still kept
        assert health.counters["frames_dropped"] == 0

    def test_a_slow_consumer_gets_the_newest_frame_without_a_burst(self):
        own, health = own_scenes(rate_hz=10.0)
        for tenth in range(30):
            own.offer(frame_at(tenth / 10), tenth * SECOND // 10)
        frame, _ = own.take(3 * SECOND)
        assert frame.stamp_ns == 29 * SECOND // 10
        assert health.counters["frames_dropped"] == 29
        own.offer(frame_at(3.01), 3 * SECOND + 10)
        assert own.take(3 * SECOND + 10) is None
        assert own.take(3 * SECOND + SECOND // 10) is not None

    def test_without_a_rate_only_the_frame_after_the_question_is_taken(self):
        own, _ = own_scenes()
        own.offer(frame_at(1), SECOND)
        assert own.take(SECOND) is None
        scene_id = own.ask(2 * SECOND)
        assert own.take(2 * SECOND) is None
        own.offer(frame_at(3), 3 * SECOND)
        frame, scene = own.take(3 * SECOND)
        assert (frame.stamp_ns, scene.scene_id) == (3 * SECOND, scene_id)
        own.offer(frame_at(4), 4 * SECOND)
        assert own.take(4 * SECOND) is None

    def test_every_question_gets_a_frame_of_its_own(self):
        own, _ = own_scenes()
        asked = [own.ask(0), own.ask(0)]
        got = []
        for second in (1, 2, 3):
            own.offer(frame_at(second), second * SECOND)
            got.append(own.take(second * SECOND))
        assert [each and each[1].scene_id for each in got] == [*asked, None]

    def test_a_frame_that_comes_twice_is_one(self):
        own, health = own_scenes(rate_hz=60.0)
        for second in (1, 2):
            own.offer(frame_at(0), second * SECOND)
            own.take(second * SECOND)
        assert health.counters["scenes_minted"] == health.counters["repeated"] == 1

    def test_a_question_whose_frame_waits_for_the_scene_before_is_not_given_up(self):
        own, health = own_scenes()
        scene_id = own.ask(0)
        own.offer(frame_at(1), SECOND)
        own.expire(60 * SECOND)
        assert not health.counters
        assert own.take(60 * SECOND)[1].scene_id == scene_id

    def test_when_time_begins_anew_frames_are_taken_as_before(self):
        own, _ = own_scenes(rate_hz=1.0)
        own.offer(frame_at(1), 500 * SECOND)
        assert own.take(500 * SECOND)
        scene_id = own.ask(500 * SECOND)
        own.offer(frame_at(2), 10 * SECOND)
        assert own.take(10 * SECOND)[1].scene_id == scene_id
        own.offer(frame_at(3), 11 * SECOND)
        assert own.take(11 * SECOND)

    def test_questions_without_frames_are_given_up_aloud_and_bounded(self):
        own, health = own_scenes()
        asked = [own.ask(0) for _ in range(20)]
        assert None not in asked[:16]
        assert set(asked[16:]) == {None}
        own.expire(10 * SECOND)
        assert not health.counters
        own.expire(10 * SECOND + 1)
        assert health.counters["capture_without_frame"] == 16
        assert asked[0] in next(iter(health.take_problems()))[1]


def stage_with(**values) -> GroundingStage:
    return GroundingStage(build(GroundingConfiguration, {"scene_source": "self", **values}))


def run_jobs(stage: GroundingStage, now_ns: int) -> list:
    published: list = []
    runner = InlineRunner(
        stage.engine(), lambda job, result: published.extend(stage.finish(job, result, now_ns))
    )
    for job in stage.jobs():
        runner.submit(job)
    runner.close()
    return published


def kinds(published: list) -> list[type]:
    return [type(item) for item in published if not isinstance(item, Timing)]


def problems(stage: GroundingStage) -> list[str]:
    return [kind for kind, _ in stage.health.take_problems()]


class TestStage:
    def test_a_frame_becomes_a_scene_with_all_that_belongs_to_it(self):
        stage = stage_with(capture_rate_hz=1)
        (scene,) = stage.handle(frame_at(7), 9 * SECOND)
        assert isinstance(scene, Scene)
        assert scene.stamp.nanoseconds == 7 * SECOND
        assert (scene.objects, scene.mode) == ([], "testing")
        published = run_jobs(stage, 9 * SECOND)
        assert kinds(published) == [Objects, Groundings, Segmentation]
        objects, groundings, segmentation = published[:3]
        assert {one.scene_id for one in (objects, groundings)} == {scene.scene_id}
        assert [one.name for one in objects.objects] == ["object_1", "object_2"]
        assert len(groundings.pairs) == 2
        assert segmentation.stamp_ns == 7 * SECOND
        assert overlap(segmentation.instances, FRAME.instances) > 0.7
        assert problems(stage) == []

    def test_while_a_scene_is_grounded_frames_pile_up_nowhere(self):
        stage = stage_with(capture_rate_hz=60)
        assert kinds(stage.handle(frame_at(0), 0)) == [Scene]
        jobs = stage.jobs()
        for number in range(1, 100):
            assert stage.handle(frame_at(number), number * SECOND) == []
            assert stage.tick(number * SECOND) == []
            assert stage.jobs() == []
        assert stage.health.counters["frames_dropped"] == 98
        stage._jobs = jobs
        published = run_jobs(stage, 100 * SECOND)
        (scene,) = [item for item in published if isinstance(item, Scene)]
        assert scene.stamp.nanoseconds == 99 * SECOND
        assert len(stage.jobs()) == 1

    def test_capture_names_the_scene_that_the_next_frame_becomes(self):
        stage = stage_with()
        assert stage.handle(frame_at(0), 0) == []
        scene_id, words = stage.capture(SECOND)
        assert scene_id in words
        assert stage.tick(SECOND) == []
        (scene,) = stage.handle(frame_at(2), 2 * SECOND)
        assert scene.scene_id == scene_id

    def test_capture_is_refused_where_scenes_are_announced(self):
        stage = stage_with(scene_source="topic")
        scene_id, words = stage.capture(0)
        assert scene_id is None
        assert "scene_source" in words

    def test_foreign_scenes_are_ignored_aloud_and_its_own_in_silence(self):
        stage = stage_with(capture_rate_hz=1)
        (own,) = stage.handle(frame_at(0), 0)
        assert stage.handle(own, 0) == []
        assert problems(stage) == []
        assert stage.handle(scene_of(BLOCKS), 0) == []
        assert problems(stage) == ["scene_ignored"]

    def test_given_instances_are_used_when_asked_for(self):
        stage = stage_with(capture_rate_hz=1, instances="given")
        assert stage.handle(frame_at(0), 0) == []
        assert problems(stage) == ["instances_missing"]
        stage.handle(frame_at(1, FRAME), SECOND)
        *_, segmentation = [one for one in run_jobs(stage, SECOND) if isinstance(one, Segmentation)]
        np.testing.assert_array_equal(segmentation.instances, FRAME.instances)

    def test_a_refused_frame_is_no_scene_and_the_next_one_is_tried(self):
        stage = stage_with(capture_rate_hz=1, instances="given", max_objects=1)
        assert stage.handle(frame_at(0, FRAME), 0) == []
        assert problems(stage) == ["scene_refused"]
        one_block = render(BLOCKS[:1])
        assert kinds(stage.handle(frame_at(2, one_block), 2 * SECOND)) == [Scene]

    def test_announced_scenes_may_be_segmented_too_unless_they_name_instances(self):
        stage = stage_with(scene_source="topic", instances="own")
        scene = scene_of([], stamp_ns=SECOND)
        published = [*stage.handle(scene, 0), *stage.handle(frame_at(1), 0), *run_jobs(stage, 0)]
        assert kinds(published) == [Objects, Groundings, Segmentation]
        named = dataclasses.replace(BARE, stamp_ns=5)
        stage.handle(scene_of(BLOCKS, stamp_ns=5, scene_id="s-5"), 0)
        assert stage.handle(named, 0) + run_jobs(stage, 0) == []
        assert problems(stage) == ["scene_refused"]

    @pytest.mark.parametrize(
        ("spoil", "kind"),
        [
            (lambda depth: depth * 0.0, "empty_depth"),
            (lambda depth: depth * np.float32("nan"), "empty_depth"),
            (lambda depth: depth * 1000.0, "depth_units"),
            (lambda depth: depth / 1000.0, "depth_units"),
        ],
        ids=["holes", "nan", "millimetres as metres", "metres as millimetres"],
    )
    def test_bad_depth_locates_nothing_but_the_scene_goes_on(self, spoil, kind):
        stage = stage_with(capture_rate_hz=1)
        frame = dataclasses.replace(BARE, depth=spoil(BARE.depth).astype(np.float32))
        assert kinds(stage.handle(frame, 0)) == [Scene]
        objects, groundings, segmentation = run_jobs(stage, 0)
        assert (objects.objects, groundings.pairs) == ([], [])
        assert not segmentation.instances.any()
        assert problems(stage) == [kind]

    def test_too_many_objects_locate_nothing_and_say_so(self):
        stage = stage_with(capture_rate_hz=1, max_objects=1)
        stage.handle(BARE, 0)
        assert run_jobs(stage, 0)[0].objects == []
        ((kind, words),) = stage.health.take_problems()
        assert kind == "grounding_failed"
        assert "2 objects were found, the parameter max_objects is 1" in words


def overlap(found: np.ndarray, true: np.ndarray) -> float:
    """Least share of a true object that one found object covers, as intersection over union."""
    shares = []
    for instance in np.unique(true[true > 0]):
        mask = true == instance
        best = np.bincount(found[mask]).argmax()
        shares.append(
            np.mean((found == best)[mask | (found == best)] & mask[mask | (found == best)])
        )
    return min(shares)
