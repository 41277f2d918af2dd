"""The camera's pacing, re-sending, losing and resuming, driven without a renderer."""

import pytest
from camera_samples import SECOND, camera, estimates, render_all, shown_ids

from ros_scenesense.messages.scenes import Labels, Scene, SceneLost
from ros_scenesense.scene import Frame
from ros_scenesense.stages.protocol import JobFailure


def test_shows_no_more_scenes_than_may_be_in_flight():
    stage = camera(in_flight=3)
    assert shown_ids(render_all(stage, SECOND)) == ["s-0000", "s-0001", "s-0002"]
    assert render_all(stage, SECOND) == []
    stage.handle(estimates("s-0001"), SECOND)
    assert shown_ids(render_all(stage, SECOND)) == ["s-0003"]


def test_scene_labels_and_frame_share_one_stamp_and_no_two_scenes_do():
    stage = camera(in_flight=2)
    published = render_all(stage, 5 * SECOND)
    stamps = {}
    for item in published:
        if isinstance(item, Scene | Labels):
            stamps.setdefault(item.scene_id, set()).add(item.stamp.nanoseconds)
    frames = [item.stamp_ns for item in published if isinstance(item, Frame)]
    assert all(len(values) == 1 for values in stamps.values())
    assert sorted(frames) == sorted(value for values in stamps.values() for value in values)
    assert len(set(frames)) == 2


def test_stops_after_the_asked_number_of_scenes():
    stage = camera(in_flight=8, scenes=3)
    assert shown_ids(render_all(stage, SECOND)) == ["s-0000", "s-0001", "s-0002"]
    for number in range(3):
        stage.handle(estimates(f"s-{number:04d}"), SECOND)
    assert stage.jobs() == []


def test_an_unanswered_scene_is_shown_again_and_finally_lost():
    stage = camera(in_flight=1, resend_s=1.0, attempts=2, scenes=1)
    first = render_all(stage, 0)
    assert stage.tick(SECOND) == []
    again = stage.tick(2 * SECOND)
    assert [item for item in again if isinstance(item, Scene)] == [
        item for item in first if isinstance(item, Scene)
    ]
    lost = stage.tick(4 * SECOND)
    assert [(item.scene_id, item.attempts) for item in lost if isinstance(item, SceneLost)] == [
        ("s-0000", 2)
    ]
    assert stage.tick(60 * SECOND) == []
    assert stage.health.counters["scenes_lost"] == 1


def test_what_is_shown_again_to_a_newcomer_is_no_attempt():
    stage = camera(in_flight=2, resend_s=1.0, attempts=1, scenes=3)
    render_all(stage, 0)
    stage.handle(estimates("s-0000"), 0)
    shown = render_all(stage, SECOND // 2)
    again = stage.show_again(SECOND)
    assert shown_ids(again) == ["s-0001", "s-0002"]
    assert set(map(id, shown)) & set(map(id, again)) == set(map(id, shown[1:]))
    assert stage.tick(3 * SECOND // 2) == []
    lost = stage.tick(3 * SECOND)
    assert [(item.scene_id, item.attempts) for item in lost] == [("s-0001", 1), ("s-0002", 1)]


def test_shows_nothing_before_there_is_an_audience():
    stage = camera(in_flight=2)
    stage.audience = False
    assert shown_ids(render_all(stage, SECOND)) == []
    stage.audience = True
    assert shown_ids(stage.tick(2 * SECOND)) == ["s-0000", "s-0001"]


def test_a_failed_rendering_is_tried_again_then_reported_lost():
    stage = camera(in_flight=1, attempts=2, scenes=1)
    (job,) = stage.jobs()
    assert stage.finish(job, JobFailure("no memory"), 0) == []
    (job,) = stage.jobs()
    (lost,) = stage.finish(job, JobFailure("no memory"), 0)
    assert isinstance(lost, SceneLost)
    assert "no memory" in lost.reason
    assert stage.jobs() == []


def test_next_scene_shows_one_more():
    stage = camera(autostart=False)
    assert stage.jobs() == []
    stage.next_scene(0)
    assert shown_ids(render_all(stage, 0)) == ["s-0000"]
    assert stage.jobs() == []


def test_estimates_that_nobody_awaits_are_counted_and_change_nothing():
    stage = camera(in_flight=1)
    render_all(stage, 0)
    for stranger in ("s-0007", "t-0000", "s-x", "-", "s-0000-0"):
        assert stage.handle(estimates(stranger), 0) == []
    assert stage.health.counters["estimates_not_awaited"] == 5
    assert stage.jobs() == []


def test_reset_loses_the_open_scenes_and_begins_a_new_session():
    stage = camera(in_flight=2)
    render_all(stage, 0)
    lost = stage.reset(SECOND)
    assert [item.scene_id for item in lost] == ["s-0000", "s-0001"]
    assert stage.session != "s"
    assert shown_ids(render_all(stage, SECOND)) == [
        f"{stage.session}-0000",
        f"{stage.session}-0001",
    ]


def test_a_restarted_camera_goes_on_where_it_was(tmp_path):
    values = {"state_dir": str(tmp_path), "in_flight": 2, "scenes": 4}
    before = camera(**values)
    render_all(before, 0)
    before.handle(estimates("s-0000"), 0)
    before.close()
    after = camera(**values)
    assert shown_ids(render_all(after, SECOND)) == ["s-0001", "s-0002"]


def test_estimates_that_came_while_the_camera_was_down_settle_the_scene(tmp_path):
    values = {"state_dir": str(tmp_path), "in_flight": 1, "scenes": 2}
    before = camera(**values)
    render_all(before, 0)
    before.close()
    after = camera(**values)
    after.handle(estimates("s-0000"), SECOND)
    assert shown_ids(render_all(after, SECOND)) == ["s-0001"]


def test_a_restarted_camera_says_again_what_is_lost(tmp_path):
    before = camera(in_flight=1, resend_s=1.0, attempts=1, scenes=1, state_dir=str(tmp_path))
    render_all(before, 0)
    before.tick(2 * SECOND)
    before.close()
    again = camera(state_dir=str(tmp_path))
    assert [(type(item), item.scene_id) for item in again.start(0)] == [(SceneLost, "s-0000")]
    again.close()


def test_open_scenes_of_a_session_that_is_not_continued_are_lost(tmp_path):
    before = camera(in_flight=2, state_dir=str(tmp_path))
    render_all(before, 0)
    before.close()
    for lost in (["s-0000", "s-0001"], []):
        other = camera(session="other", state_dir=str(tmp_path))
        assert [item.scene_id for item in other.start(0)] == lost
        assert other.health.counters["scenes_lost"] == len(lost)
        other.close()


def test_training_mode_lets_labels_be_learned_from():
    for mode, use in (("training", "train"), ("testing", "evaluate")):
        published = render_all(camera(mode=mode), 0)
        assert {item.use for item in published if isinstance(item, Labels)} == {use}


@pytest.mark.parametrize("session", ["", "lab-1"])
def test_scene_ids_of_any_session_name_are_recognised(session):
    stage = camera(session=session, in_flight=1, scenes=1)
    (scene_id,) = shown_ids(render_all(stage, 0))
    stage.handle(estimates(scene_id), 0)
    assert stage.health.counters["scenes_settled"] == 1
