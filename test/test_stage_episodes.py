"""Episodes in the camera stage: actions, their answers, the scenes of their effects, restarts."""

import msgspec
import pytest
from camera_samples import SECOND, camera, estimates, render_all, rendered, shown_ids

from ros_scenesense.messages.actions import Action, ActionResult, Goal, Plan, PlannedAction
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.scenes import Labels, Scene
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.actions import ActionOutcome
from ros_scenesense.simulation.episodes import Story
from ros_scenesense.stages.protocol import JobFailure
from ros_scenesense.stages.simulated_camera import SimulatedCameraStage

PICKUP = PlannedAction(kind="pickup", object="red_cube")
PUTDOWN = PlannedAction(kind="putdown", object="red_cube", location="table")


def action(
    scene_id: str, planned: PlannedAction = PICKUP, id: str = "a1", episode: str = "e"
) -> Action:
    return Action(
        stamp=Stamp.of(7), scene_id=scene_id, id=id, episode_id=episode, step=0, action=planned
    )


def answers(published: list) -> list[tuple[str, str]]:
    return [(item.id, item.outcome) for item in published if isinstance(item, ActionResult)]


def scenes(published: list) -> list[Scene]:
    return [item for item in published if isinstance(item, Scene)]


def execute(stage: SimulatedCameraStage, now_ns: int, executed: bool = True) -> list:
    """Lets a stand-in for the engine do what the stage asks for; returns what is published."""
    published = []
    for job in stage.jobs():
        scene, seconds = rendered()
        if job.method == "act":
            outcome = ActionOutcome(executed, "" if executed else "the hand is empty")
            result = (outcome, scene if executed else None, seconds)
            published += stage.finish(job, result, now_ns)
        else:
            published += stage.finish(job, (scene, seconds), now_ns)
    return published


def waiting_camera(**values) -> SimulatedCameraStage:
    """A camera that has shown the scene s-0000 and waits."""
    stage = camera(autostart=False, **values)
    stage.next_scene(0)
    assert shown_ids(render_all(stage, 0)) == ["s-0000"]
    return stage


def test_an_executed_action_is_answered_and_its_effect_shown_as_a_new_scene():
    stage = waiting_camera()
    assert stage.handle(action("s-0000"), SECOND) == []
    (job,) = stage.jobs()
    assert (job.method, job.arguments) == ("act", (Story(0, 0), PICKUP))
    published = stage.finish(job, (ActionOutcome(True), *rendered()), SECOND)
    (answer,) = (item for item in published if isinstance(item, ActionResult))
    assert answer == ActionResult(stamp=Stamp.of(7), scene_id="s-0000", id="a1", outcome="executed")
    (scene,) = scenes(published)
    assert (scene.scene_id, scene.episode_id, scene.step) == ("s-0001", "e", 1)
    assert scene.in_hand == "red_cube"
    labels = next(item for item in published if isinstance(item, Labels))
    frame = next(item for item in published if isinstance(item, Frame))
    assert labels.stamp == scene.stamp == Stamp.of(frame.stamp_ns)


def test_the_second_action_goes_on_from_the_first():
    stage = waiting_camera()
    stage.handle(action("s-0000"), SECOND)
    execute(stage, SECOND)
    stage.handle(action("s-0001", PUTDOWN, "a2"), SECOND)
    (job,) = stage.jobs()
    assert job.arguments == (Story(0, 0, (PICKUP,)), PUTDOWN)
    (scene,) = scenes(stage.finish(job, (ActionOutcome(True), *rendered()), SECOND))
    assert (scene.scene_id, scene.step, scene.in_hand) == ("s-0002", 2, None)


def test_a_new_episode_goes_on_in_the_same_world_and_counts_anew():
    stage = waiting_camera()
    stage.handle(action("s-0000"), SECOND)
    execute(stage, SECOND)
    stage.handle(action("s-0001", PUTDOWN, "a2", episode="f"), SECOND)
    (scene,) = scenes(execute(stage, SECOND))
    assert (scene.episode_id, scene.step) == ("f", 1)


def test_a_repeated_action_is_answered_but_not_executed_again():
    stage = waiting_camera()
    asked = action("s-0000")
    stage.handle(asked, SECOND)
    assert stage.handle(asked, SECOND) == []
    first = answers(execute(stage, SECOND))
    assert answers(stage.handle(asked, SECOND)) == first == [("a1", "executed")]
    assert stage.jobs() == []
    assert stage.health.counters["actions_executed"] == 1
    assert stage.health.counters["actions_repeated"] == 2


def test_what_the_world_refuses_is_answered_and_no_scene_shown():
    stage = waiting_camera()
    stage.handle(action("s-0000"), SECOND)
    published = execute(stage, SECOND, executed=False)
    assert [(item.id, item.outcome, item.reason) for item in published] == [
        ("a1", "refused", "the hand is empty")
    ]
    stage.handle(action("s-0000", id="a2"), SECOND)
    assert answers(execute(stage, SECOND)) == [("a2", "executed")]


def test_an_engine_that_fails_is_a_refusal():
    stage = waiting_camera()
    stage.handle(action("s-0000"), SECOND)
    (job,) = stage.jobs()
    (answer,) = stage.finish(job, JobFailure("stopped after 30 s", timed_out=True), SECOND)
    assert answer.outcome == "refused"
    assert "stopped after 30 s" in answer.reason


@pytest.mark.parametrize("about", ["s-0001", "s-x", "t-0000", "nonsense"])
def test_an_action_about_another_scene_is_refused(about):
    stage = waiting_camera()
    (answer,) = stage.handle(action(about), SECOND)
    assert (answer.outcome, answer.scene_id) == ("refused", about)
    assert "s-0000" in answer.reason
    assert stage.jobs() == []
    assert answers(stage.handle(action(about), SECOND)) == [("a1", "refused")]


def test_an_action_before_the_first_scene_or_during_another_is_refused():
    stage = camera(autostart=False)
    (answer,) = stage.handle(action("s-0000"), 0)
    assert answer.reason == "no scene was shown yet"
    stage = waiting_camera()
    stage.handle(action("s-0000"), SECOND)
    (answer,) = stage.handle(action("s-0000", id="a2"), SECOND)
    assert answer.reason == "action a1 is being executed"


def test_the_camera_does_not_go_on_by_itself_while_an_episode_is_open():
    stage = camera(in_flight=1, episode_timeout_s=10.0)
    assert shown_ids(render_all(stage, 0)) == ["s-0000"]
    stage.handle(action("s-0000"), 0)
    assert shown_ids(execute(stage, 0)) == ["s-0001"]
    for scene_id in ("s-0000", "s-0001"):
        stage.handle(estimates(scene_id), SECOND)
    stage.tick(10 * SECOND)
    assert stage.jobs() == []
    stage.tick(11 * SECOND)
    assert shown_ids(render_all(stage, 11 * SECOND)) == ["s-0002"]
    assert stage.health.counters["episodes_timed_out"] == 1


def test_a_scene_that_was_being_rendered_is_shown_after_the_episode():
    stage = camera(in_flight=2)
    first, second = stage.jobs()
    assert shown_ids(stage.finish(first, rendered(), 0)) == ["s-0000"]
    stage.handle(action("s-0000"), 0)
    assert shown_ids(stage.finish(second, rendered(), 0)) == []
    assert shown_ids(execute(stage, 0)) == ["s-0002"]
    stage.next_scene(0)
    assert shown_ids(stage.tick(0)) == ["s-0001"]


def test_reset_refuses_the_action_under_way_and_drops_its_effect():
    stage = waiting_camera()
    stage.handle(action("s-0000"), SECOND)
    (job,) = stage.jobs()
    assert answers(stage.reset(SECOND)) == [("a1", "refused")]
    assert stage.finish(job, (ActionOutcome(True), *rendered()), SECOND) == []
    assert stage.jobs() == []


def test_a_restarted_camera_remembers_answers_and_goes_on_with_the_episode(tmp_path):
    before = waiting_camera(state_dir=str(tmp_path))
    before.handle(action("s-0000"), SECOND)
    (shown,) = scenes(execute(before, SECOND))
    before.close()
    after = camera(state_dir=str(tmp_path), autostart=True, in_flight=8)
    after.start(2 * SECOND)
    assert answers(after.handle(action("s-0000"), 2 * SECOND)) == [("a1", "executed")]
    jobs = {job.key: job for job in after.jobs()}
    assert set(jobs) == {"s-0000", "s-0001"}
    assert (jobs["s-0001"].method, jobs["s-0001"].arguments) == (
        "replay",
        (Story(0, 0, (PICKUP,)),),
    )
    (again,) = scenes(after.finish(jobs["s-0001"], rendered(), 2 * SECOND))
    assert msgspec.structs.replace(again, stamp=shown.stamp) == shown
    after.handle(action("s-0001", PUTDOWN, "a2"), 2 * SECOND)
    (act,) = (job for job in after.jobs() if job.method == "act")
    assert act.arguments == (Story(0, 0, (PICKUP,)), PUTDOWN)


def goal(text: str = "on(a, b)", id: str = "g") -> Goal:
    return Goal(id=id, goal=text)


def plan(outcome: str, text: str = "on(a, b)", id: str = "g", scene_id: str = "s-0000") -> Plan:
    return Plan(stamp=Stamp.of(1), scene_id=scene_id, id=id, goal=text, outcome=outcome, actions=[])


def test_from_a_goal_on_the_camera_shows_nothing_new_until_the_last_word_on_it():
    stage = camera(in_flight=1)
    assert shown_ids(render_all(stage, 0)) == ["s-0000"]
    stage.handle(estimates("s-0000"), 0)
    (job,) = stage.jobs()
    stage.handle(goal(), 0)
    assert shown_ids(stage.finish(job, rendered(), 0)) == []
    stage.handle(plan("found"), 0)
    stage.handle(plan("reached", text="on(b, a)", id="h"), 0)
    assert shown_ids(stage.tick(SECOND)) == []
    stage.handle(plan("no_plan"), SECOND)
    assert shown_ids(stage.tick(SECOND)) == ["s-0001"]


def test_a_goal_holds_the_camera_no_longer_than_an_episode():
    stage = camera(in_flight=1, episode_timeout_s=10.0)
    assert shown_ids(render_all(stage, 0)) == ["s-0000"]
    stage.handle(goal(), 0)
    stage.handle(estimates("s-0000"), 0)
    stage.handle(goal(), 9 * SECOND)
    stage.tick(10 * SECOND)
    assert stage.jobs() == []
    stage.tick(11 * SECOND)
    assert shown_ids(render_all(stage, 11 * SECOND)) == ["s-0001"]


def test_a_refusal_names_the_scene_that_is_shown():
    stage = waiting_camera()
    (answer,) = stage.handle(action("t-0003"), SECOND)
    assert answer.shown == "s-0000"
    stage.handle(action("s-0000", id="a2"), SECOND)
    (answer,) = execute(stage, SECOND, executed=False)
    assert answer.shown is None


def test_after_a_restart_the_last_word_on_the_goal_still_ends_its_episode(tmp_path):
    before = waiting_camera(state_dir=str(tmp_path))
    before.handle(action("s-0000", episode="g"), SECOND)
    execute(before, SECOND)
    before.close()
    after = camera(state_dir=str(tmp_path), autostart=True, in_flight=8)
    after.start(2 * SECOND)
    assert {job.key for job in after.jobs()} == {"s-0000", "s-0001"}
    after.handle(plan("reached", id="other", text="x"), 2 * SECOND)
    assert after.jobs() == []
    after.handle(plan("reached", id="g"), 2 * SECOND)
    assert "s-0002" in {job.key for job in after.jobs()}
