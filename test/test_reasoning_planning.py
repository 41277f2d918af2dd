"""Planning in the robot's domain: the paper's first trace, aims, limits, and brute force."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_samples import (
    LEARNED,
    TRACE_1,
    World,
    scene,
    shortest_plans,
    situation,
    words,
)

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.action_language import parse, parse_goal
from ros_scenesense.reasoning.described_scenes import described_scene
from ros_scenesense.reasoning.obstacles import obstacles
from ros_scenesense.reasoning.planning import Aim, PlanningLimits, PlanningTask, PlanOutcome, plan
from ros_scenesense.reasoning.situations import Situation, robot_domain

ONE = PlanningLimits()
ALL = PlanningLimits(every=True)
PAPER_PLAN = [
    "pickup(duck)",
    "putdown(duck, table)",
    "pickup(white_cube)",
    "putdown(white_cube, duck)",
    "pickup(red_can)",
    "putdown(red_can, white_cube)",
]
BETTER_PLAN = [*PAPER_PLAN[:3], "putdown(white_cube, table)", *PAPER_PLAN[4:]]


def solve(known, goal, limits=ONE, withheld=()):
    start = situation(known, withheld)
    return plan(start.task(start.goal(goal)), limits)


def trace_1(limits, withheld=()):
    return solve(described_scene(TRACE_1, "trace"), "on(red_can, white_cube)", limits, withheld)


def test_without_the_irregular_surface_axiom_there_are_two_plans_of_six_actions():
    found = trace_1(ALL, withheld=LEARNED)
    assert [words(each) for each in found.plans] == [PAPER_PLAN, BETTER_PLAN]


def test_with_the_irregular_surface_axiom_there_is_one_plan():
    without = [each for each in LEARNED if each != "s2"]
    for withheld in (without, ()):
        assert [words(each) for each in trace_1(ALL, withheld).plans] == [BETTER_PLAN]


def test_of_equally_short_plans_the_one_with_fewest_objects_on_the_table_is_chosen():
    (found,) = trace_1(PlanningLimits(), withheld=LEARNED).plans
    assert words(found) == PAPER_PLAN
    assert found.counted[1] == 1


def test_of_equally_short_plans_the_one_that_is_surest_to_stay_is_chosen():
    known = scene(["abc", "d"])
    for withheld, place, unsure in (((), "table", 1), (("s1",), "d", 0)):
        (found,) = solve(known, "on(b, c)", ONE, withheld).plans
        assert words(found)[:2] == ["pickup(c)", f"putdown(c, {place})"]
        # Of b itself it is never sure that it will stay.
        assert found.unsure == unsure
    every = solve(known, "on(b, c)", ALL).plans
    assert [each.unsure for each in every] == [1, 2]


def test_of_equally_good_places_a_large_object_is_chosen():
    sizes = {"a": "small", "b": "medium", "c": "large", "d": "medium"}
    objects = {name: {"size": size, "surface": "flat"} for name, size in sizes.items()}
    known = described_scene({"objects": objects}, "test")
    (found,) = solve(known, "-on(a, table), no in_hand(R, X)").plans
    assert words(found) == ["pickup(a)", "putdown(a, c)"]
    every = solve(known, "-on(a, table), no in_hand(R, X)", ALL).plans
    assert [words(each)[1][-2] for each in every] == ["c", "b", "d"]


def test_a_default_does_not_excuse_what_another_one_speaks_against():
    hopeful = parse("hopeful: normally stable(A) if not small_base(A).", "test", robot_domain())
    start = Situation(hopeful.description, scene(["abcd", "e"]))
    task = start.task(start.goal("-on(e, table), no in_hand(R, X)"))
    found = plan(task, ALL)
    assert [words(each) for each in found.plans] == [["pickup(e)", "putdown(e, d)"]]
    assert len(found.plans[0].exceptions) == 1
    # A goal that needs the default has it.
    asked = start.task(start.goal("stable(d), on(d, e)"))
    assert plan(asked, ONE).outcome is PlanOutcome.FOUND
    without = Situation(robot_domain(), scene(["abcd", "e"]))
    asked = without.task(without.goal("stable(d), on(d, e)"))
    assert plan(asked, PlanningLimits(max_steps=4)).outcome is PlanOutcome.NO_PLAN


def test_a_default_has_an_exception_only_where_no_plan_is_as_short_without():
    known = scene(["ab", "c"], small="c")
    (found,) = solve(known, "on(b, c)", ALL).plans
    assert words(found) == ["pickup(b)", "putdown(b, c)"]
    assert [(str(literal), step) for literal, step in found.exceptions] == [("-stable(b)", 2)]
    (found,) = solve(known, "on(b, a)", ALL).plans
    assert (found.actions, found.exceptions) == ((), ())


def test_an_optimal_plan_takes_a_longer_way_round_to_have_fewer_exceptions():
    known = scene(["sb", "a"], small="s")
    (short,) = solve(known, "on(a, b)", PlanningLimits(Aim.SHORTEST)).plans
    assert (words(short), len(short.exceptions)) == (["pickup(a)", "putdown(a, b)"], 1)
    found = solve(known, "on(a, b)", PlanningLimits(Aim.OPTIMAL))
    assert found.plans[0].exceptions == ()
    assert words(found.plans[0]) == [
        "pickup(b)",
        "putdown(b, table)",
        "pickup(a)",
        "putdown(a, b)",
    ]


def test_strict_axioms_know_no_exception():
    known = scene(["a", "b"], irregular="b")
    assert solve(known, "on(a, b)").outcome is PlanOutcome.NO_PLAN
    assert solve(known, "on(a, b)", withheld=("s2",)).outcome is PlanOutcome.FOUND


def test_what_is_unstable_already_does_not_hinder_a_plan():
    known = scene(["ab", "c", "d"], irregular="a")
    assert words(solve(known, "on(c, d)").plans[0]) == ["pickup(c)", "putdown(c, d)"]


def test_within_a_horizon_all_plans_are_found_that_reach_the_goal_for_the_first_time_at_their_end():
    known = scene(["a", "b", "c"])
    found = solve(known, "on(a, b)", PlanningLimits(Aim.HORIZON, every=True, horizon=4))
    start = World(frozenset({("a",), ("b",), ("c",)}))
    expected = set()
    for length in (2, 4):
        for path in paths(start, length):
            reached = [world.on("a", "b") for _, world in path]
            if True in reached and reached.index(True) == length:
                expected.add(tuple(action for action, _ in path[1:]))
    assert {tuple(words(each)) for each in found.plans} == expected
    assert found.complete


def paths(world, length):
    if length == 0:
        return [[("", world)]]
    return [
        [*path, (action, after)]
        for path in paths(world, length - 1)
        for action, after, _ in path[-1][1].successors("", "")
    ]


stacks = st.permutations("abcd").flatmap(
    lambda names: st.lists(st.booleans(), min_size=3, max_size=3).map(
        lambda cuts: "".join(
            name + (" " if cut else "") for name, cut in zip(names, [*cuts, False], strict=True)
        ).split()
    )
)


@settings(max_examples=30, deadline=None)
@given(
    stacks,
    st.sets(st.sampled_from("abcd"), max_size=2),
    st.sets(st.sampled_from("abcd"), max_size=1),
    st.sampled_from(list(itertools.permutations("abcd", 2))),
)
def test_the_shortest_plans_are_those_of_brute_force(stacks, small, irregular, goal):
    small, irregular = "".join(small), "".join(irregular)
    found = solve(
        scene(stacks, small, irregular),
        f"on({goal[0]}, {goal[1]})",
        PlanningLimits(every=True, max_steps=6),
    )
    start = World(frozenset(map(tuple, stacks)))
    cost, plans = shortest_plans(start, *goal, small, irregular, most=6)
    assert {tuple(words(each)) for each in found.plans} == plans
    assert all(len(each.exceptions) == cost for each in found.plans)


def test_quantified_and_negated_goals():
    known = scene(["abc", "d"])
    assert words(solve(known, "no on(X, a)").plans[0])[-1] == "pickup(b)"
    assert words(solve(known, "all on(X, table)").plans[0])[-1] == "putdown(b, table)"
    assert words(solve(known, "-on(c, b)").plans[0]) == ["pickup(c)"]
    assert solve(known, "-on(a, b)").outcome is PlanOutcome.REACHED


def test_occlusion_is_cured_by_moving_either_object():
    known = described_scene({"objects": {"a": None, "b": None}, "relations": ["behind(a, b)"]}, "x")
    found = solve(known, "-occluded(a), no in_hand(R, X)", ALL)
    assert {tuple(words(each)) for each in found.plans} == {
        ("pickup(a)", "putdown(a, table)"),
        ("pickup(a)", "putdown(a, b)"),
        ("pickup(b)", "putdown(b, table)"),
        ("pickup(b)", "putdown(b, a)"),
    }


def test_reduce_clutter_leaves_as_little_on_the_table_as_stability_allows():
    known = scene(["a", "b", "c"], irregular="c")
    found = solve(known, "reduce_clutter")
    assert found.outcome is PlanOutcome.FOUND
    best = found.plans[0]
    assert best.counted[0] == 1
    assert words(best)[-1].startswith("putdown(c, ")
    again = solve(scene(["abc"], irregular="c"), "reduce_clutter")
    assert again.outcome is PlanOutcome.REACHED


def test_a_refused_action_is_not_planned_first():
    start = situation(scene(["a", "b"]))
    task = start.task(start.goal("on(a, b)"))
    first = plan(task).plans[0].actions[0]
    blocked = PlanningTask(**{**vars(task), "forbidden": (first,)})
    assert words(plan(blocked).plans[0]) == [
        "pickup(b)",
        "putdown(b, table)",
        "pickup(a)",
        "putdown(a, b)",
    ]


def test_without_a_plan_it_is_said_what_stands_in_the_way():
    start = situation(scene(["a", "b"], irregular="b"))
    task = start.task(start.goal("on(a, b)"))
    found = plan(task)
    assert (found.outcome, found.steps) == (PlanOutcome.NO_PLAN, 20)
    assert str(obstacles(task)) == (
        "putdown(rob1, a, b) at step 1: it would bring about -stable(X)"
    )
    task = start.task(start.goal("front(a, b), on(a, table)"))
    assert str(obstacles(task)) == "no action brings about front(a, b)"


def test_limits_end_a_search_and_say_so():
    known = scene(["a", "b", "c", "d"])
    few = solve(known, "no on(X, table)", PlanningLimits(max_steps=3))
    assert (few.outcome, few.steps, few.complete) == (PlanOutcome.NO_PLAN, 3, True)
    some = solve(known, "on(a, b), on(c, d)", PlanningLimits(every=True, max_plans=1))
    assert (some.outcome, len(some.plans), some.complete) == (PlanOutcome.FOUND, 1, False)
    late = solve(known, "no on(X, table)", PlanningLimits(time_limit_s=1e-9))
    assert late.outcome is PlanOutcome.TIMED_OUT


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ("on(a", "expected ')'"),
        ("on(a, z)", "'z'"),
        ("onn(a, b)", "'onn'"),
        ("a). bad(", "goal:1"),
        ("on(a, hidden)", "hidden is not located in this scene"),
        ("on(a, b c)", "'b c' is called object_1"),
    ],
)
def test_a_goal_that_cannot_be_read_is_refused_with_the_reason(goal, words):
    content = {"objects": {"a": None, "b c": None, "hidden": {"located": False}}}
    with pytest.raises(LanguageError) as error:
        situation(described_scene(content, "x")).goal(goal)
    assert words in str(error.value)


def test_whatever_objects_are_called_no_name_becomes_program_text():
    hostile = ["a). bad(", 'x" :- y.', "not", "table ", "Ünïcode", "#show", "l" * 64]
    content = {"objects": dict.fromkeys(["cube", *hostile])}
    start = situation(described_scene(content, "x"))
    (found,) = plan(start.task(start.goal("on(cube, object_1)"))).plans
    planned = [start.planned(action) for action in found.actions]
    assert [(each.kind, each.object, each.location) for each in planned] == [
        ("pickup", "cube", None),
        ("putdown", "cube", "a). bad("),
    ]
    assert [start.action(each) for each in planned] == list(found.actions)


def test_a_domain_of_ones_own_is_planned_in():
    domain = parse(
        """
        sort room = {hall, kitchen, bath}.
        inertial fluent at(room), lit(room).
        defined fluent dark(room).
        action go(room, room), switch(room).
        go(A, B) causes at(B), -at(A).
        switch(A) causes lit(A) if -lit(A).
        switch(A) causes -lit(A) if lit(A).
        dark(A) if -lit(A).
        impossible go(A, B) if not at(A).
        impossible go(A, B) if dark(A).
        impossible go(A, A).
        impossible switch(A) if -at(A).
        initially at(hall).
        """
    )
    goal = parse_goal("at(bath), no dark(X)", domain.description)
    found = plan(PlanningTask(domain.description, domain.history.initial, goal), ALL)
    assert [list(map(str, each.actions)) for each in found.plans] == [
        [
            "switch(hall)",
            "go(hall, kitchen)",
            "switch(kitchen)",
            "go(kitchen, bath)",
            "switch(bath)",
        ]
    ]
