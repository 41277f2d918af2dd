"""Goals in the reasoner: plans, actions, what came of them, diagnosis, restarts. No camera."""

from __future__ import annotations

import pytest
from goal_samples import GOAL, SECOND, World, started
from planning_samples import LEARNED

from ros_scenesense.messages.actions import (
    Action,
    Goal,
    Plan,
    PlannedAction,
    StateLiteral,
    Transition,
)
from ros_scenesense.stages.goals import GoalLimits
from ros_scenesense.stages.protocol import JobFailure


def plans(published):
    return [(each.outcome, len(each.actions)) for each in published if isinstance(each, Plan)]


def actions(published):
    return [
        (each.action.kind, each.action.object, each.action.location)
        for each in published
        if isinstance(each, Action)
    ]


PAPER_ACTIONS = [
    ("pickup", "duck", None),
    ("putdown", "duck", "table"),
    ("pickup", "white_cube", None),
    ("putdown", "white_cube", "duck"),
    ("pickup", "red_can", None),
    ("putdown", "red_can", "white_cube"),
]


def test_a_goal_is_planned_for_and_pursued_action_by_action():
    world, published = started()
    assert [type(each) for each in published] == [Plan, Action]
    everything = world.pursue(published)
    assert actions(everything) == PAPER_ACTIONS
    assert plans(everything) == [("found", 6), ("reached", 0)]
    last = everything[-1]
    assert (last.goal, last.scene_id, last.actions) == (GOAL.goal, "s-0006", [])
    plan = next(each for each in everything if isinstance(each, Plan))
    assert len(plan.purposes) == len(plan.actions)
    assert plan.purposes[-1] == (
        "without it the goal would not be achieved: on(red_can, white_cube)"
    )
    assert world.ledger.open_goal() is None


def test_the_papers_first_trace_with_failure_diagnosis_and_a_new_plan_of_two_actions():
    world, published = started()
    world.slippery = {"duck"}
    everything = world.pursue(published)
    assert plans(everything) == [("found", 6), ("found", 2), ("reached", 0)]
    assert actions(everything) == [*PAPER_ACTIONS[:4], *PAPER_ACTIONS[4:]]
    again = [each for each in everything if isinstance(each, Plan)][1]
    assert again.scene_id == "s-0004"
    assert again.reason == (
        "after putdown(white_cube, duck) on(white_cube, duck) was expected but "
        "on(white_cube, table) was seen: fall(white_cube)"
    )
    goal = again.id
    history = world.ledger.history(goal)
    assert [bool(diagnosis) for _, diagnosis in history] == [False] * 3 + [True] + [False] * 2


def test_with_the_axiom_the_first_plan_is_the_better_one():
    world, published = started(withheld=set(LEARNED) - {"s2"})
    world.slippery = {"duck"}
    everything = world.pursue(published)
    assert plans(everything) == [("found", 6), ("reached", 0)]
    assert ("putdown", "white_cube", "table") in actions(everything)


def test_transitions_tell_what_was_what_should_be_and_what_is():
    world, published = started()
    world.slippery = {"duck"}
    everything = world.pursue(published)
    transitions = [each for each in everything if isinstance(each, Transition)]
    assert [each.step for each in transitions] == [0, 1, 2, 3, 4, 5]
    failed = transitions[3]
    assert (failed.scene_before, failed.scene_after) == ("s-0003", "s-0004")
    assert failed.action == PlannedAction(kind="putdown", object="white_cube", location="duck")
    on_duck = StateLiteral(fluent="on", arguments=["white_cube", "duck"])
    on_table = StateLiteral(fluent="on", arguments=["white_cube", "table"])
    held = StateLiteral(fluent="in_hand", arguments=["rob1", "white_cube"])
    assert held in failed.before
    assert held not in failed.after
    assert on_duck in failed.expected
    assert on_duck not in failed.after
    assert on_table in failed.after
    irregular = StateLiteral(fluent="obj_surface", arguments=["duck", "irregular"])
    assert irregular in failed.before


def test_a_plan_is_made_anew_when_the_robot_has_learned_something():
    world, published = started()
    published = world.do(published[-1])
    world.withheld -= {"s2"}
    published = world.do(published[-1])
    plan = next(each for each in published if isinstance(each, Plan))
    assert plan.reason == "what the robot knows has changed"
    assert PlannedAction(kind="putdown", object="white_cube", location="table") in plan.actions


def test_what_cannot_be_explained_is_said_and_a_new_plan_starts_from_what_is_seen():
    world, published = started()
    published = world.do(published[-1])
    world.on["white_cube"] = "table"
    world.on["red_can"] = "white_cube"
    published = world.do(published[-1])
    (plan,) = (each for each in published if isinstance(each, Plan))
    assert plan.outcome == "reached"
    ((_, _), (_, diagnosis)) = world.ledger.history(plan.id)
    assert diagnosis.endswith("which nothing explains that the domain knows of")


def test_what_is_not_located_any_more_surprises_nobody():
    world, published = started()
    published = world.do(published[-1])
    world.hidden = {"duck"}
    published = world.do(published[-1])
    assert [type(each) for each in published] == [Transition, Action]


def test_an_action_about_a_scene_that_is_not_shown_any_more_is_planned_anew():
    world, published = started()
    published = world.answer(published[-1], "refused", reason="not shown", shown="s-0002")
    assert published == []
    assert world.show() == []
    published = world.show()
    assert [type(each) for each in published] == [Plan, Action]
    assert published[-1].scene_id == "s-0002"
    assert world.pursue(published)[-1].outcome == "reached"


def test_what_the_world_refuses_is_not_planned_first_again():
    world, published = started()
    published = world.do(published[-1])
    assert published[-1].action.location == "table"
    published = world.answer(published[-1], "refused", reason="the table has no room for duck")
    transition, plan, action = published
    assert (transition.outcome, transition.scene_after) == ("refused", transition.scene_before)
    assert StateLiteral(fluent="on", arguments=["duck", "table"]) in transition.expected
    assert "putdown(duck, table) was refused: the table has no room" in plan.reason
    assert action.action != PlannedAction(kind="putdown", object="duck", location="table")


def test_without_another_way_the_refusal_is_the_reason():
    world = World()
    world.objects = {"a": None}
    world.on = {"a": "table"}
    world.show()
    published = world.want(Goal(goal="in_hand(rob1, a)"))
    (_, plan) = world.answer(published[-1], "refused", reason="it is glued")
    assert (plan.outcome, "refused was pickup(a): it is glued" in plan.reason) == ("no_plan", True)


def test_a_goal_is_given_up_after_so_many_plans():
    world, published = started(limits=GoalLimits(20.0, 12, 1, 5.0))
    world.slippery = {"duck"}
    last = world.pursue(published)[-1]
    assert (last.outcome, last.reason.startswith("the goal was not reached by 1 plans")) == (
        "failed",
        True,
    )


@pytest.mark.parametrize(
    ("goal", "outcome", "words"),
    [
        ("on(red_can", "refused", "expected ')'"),
        ("on(red_can, cow)", "refused", "'cow'"),
        ("a). bad(", "refused", "goal:1"),
        ("no on(X, table)", "no_plan", "there is no plan up to step 12"),
        ("on(duck, white_cube)", "reached", ""),
    ],
)
def test_a_goal_that_leads_to_no_action_is_answered_at_once(goal, outcome, words):
    world = World()
    world.show()
    (plan,) = world.want(Goal(goal=goal))
    assert (plan.outcome, plan.scene_id, plan.goal) == (outcome, "s-0000", goal)
    assert words in plan.reason
    assert world.ledger.open_goal() is None


def test_a_goal_that_comes_before_any_scene_waits_for_one():
    world = World()
    assert world.want() == []
    assert [type(each) for each in world.show()] == [Plan, Action]


def test_one_goal_at_a_time_and_each_once():
    world, published = started()
    assert world.want() == []
    (refused,) = world.want(Goal(goal="on(duck, red_can)", id="other"))
    assert (refused.id, refused.outcome) == ("other", "refused")
    assert "'on(red_can, white_cube)' is being pursued" in refused.reason
    world.pursue(published)
    first = Goal(goal="on(duck, white_cube)", id="g1")
    assert plans(world.pursue(world.want(first)))[-1] == ("reached", 0)
    assert world.want(first) == []
    assert world.health.counters["goals_repeated"] == 2


@pytest.mark.parametrize("executed", [False, True])
def test_a_goal_for_which_nothing_comes_any_more_has_failed(executed):
    world, published = started()
    missing = "answer to an action"
    if executed:
        assert world.answer(published[-1], "executed") == []
        missing = "scene that shows the effect"
    assert world.keeper.tick(4 * SECOND) == []
    (plan,) = world.keeper.tick(6 * SECOND)
    assert plan.outcome == "failed"
    assert missing in plan.reason
    assert world.keeper.tick(20 * SECOND) == []


def test_a_worker_that_fails_ends_the_goal_with_the_reason():
    world = World()
    world.show()
    world.keeper.take_goal(GOAL, 0)
    (job,) = world.keeper.jobs()
    (plan,) = world.keeper.finish(job, JobFailure("stopped after 70 s", timed_out=True), 0)
    assert (plan.outcome, plan.reason) == ("timed_out", "stopped after 70 s")
    assert world.keeper.finish(job, JobFailure("late"), 0) == []


def test_a_restarted_reasoner_asks_again_and_goes_on(tmp_path):
    path = tmp_path / "reasoner.db"
    before, published = started(path=path)
    published = before.do(published[-1])
    asked = published[-1]
    before.keeper.close()
    after = World(path=path)
    after.on, after.held, after.episode = before.on, before.held, before.episode
    assert after.keeper.start(0) == [asked]
    # The scene that it planned in comes again, as all that was latched.
    after.number = before.number - 1
    assert after.show() == []
    everything = after.pursue([asked])
    assert everything[-1].outcome == "reached"
    assert len(after.ledger.history(asked.episode_id)) == 6


def test_a_restarted_reasoner_that_has_forgotten_the_scene_plans_from_what_it_sees(tmp_path):
    path = tmp_path / "reasoner.db"
    before, published = started(path=path)
    before.answer(published[-1], "executed")
    before.keeper.close()
    after = World(path=path)
    assert after.keeper.start(0) == []
    after.held, after.number = "duck", 1
    del after.on["duck"]
    after.episode = (published[-1].episode_id, 1)
    published = after.show()
    assert [type(each) for each in published] == [Plan, Action]
    assert published[-1].step == 1
