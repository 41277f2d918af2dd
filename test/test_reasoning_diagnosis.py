"""Diagnosis and projection: what must have happened, and what follows from what the robot does."""

import itertools

import pytest
from planning_samples import LEARNED, TRACE_1, scene, situation, words

from ros_scenesense.errors import ReasoningError
from ros_scenesense.knowledge.description import Happened, History, Observation
from ros_scenesense.knowledge.literals import Atom
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.reasoning.described_scenes import described_scene
from ros_scenesense.reasoning.diagnosis import DiagnosisOutcome, diagnose
from ros_scenesense.reasoning.planning import plan
from ros_scenesense.reasoning.projection import project


def seen(names, on, step):
    """Everything that was seen of `on` at a step."""
    pairs = itertools.product(names, [*names, "table"])
    return tuple(
        Observation(Atom("on", (Constant(a), Constant(b))), (a, b) in on, step)
        for a, b in pairs
        if a != b
    )


def trace_1():
    """The paper's first plan, without the axioms that are to be learned, up to its failure."""
    start = situation(described_scene(TRACE_1, "trace"), LEARNED)
    best = plan(start.task(start.goal("on(red_can, white_cube)"))).plans[0]
    assert words(best)[3] == "putdown(white_cube, duck)"
    happened = tuple(Happened(action, step) for step, action in enumerate(best.actions[:4]))
    return start, happened


def test_the_cube_that_is_not_on_the_duck_has_one_explanation():
    start, happened = trace_1()
    names = ["duck", "white_cube", "red_can"]
    fallen = {(name, "table") for name in names}
    found = diagnose(start.description, History(seen(names, fallen, 4), happened, start.initial))
    assert found.outcome is DiagnosisOutcome.EXPLAINED
    assert [list(map(str, events)) for events in found.explanations] == [
        ["fall(white_cube) at step 3"]
    ]
    assert found.complete


def test_after_the_failure_two_actions_lead_to_the_goal():
    known = described_scene({**TRACE_1, "relations": []}, "after")
    start = situation(known, LEARNED)
    found = plan(start.task(start.goal("on(red_can, white_cube)")))
    assert words(found.plans[0]) == ["pickup(red_can)", "putdown(red_can, white_cube)"]


def test_what_was_expected_needs_no_explanation():
    start, happened = trace_1()
    on = {("duck", "table"), ("white_cube", "duck"), ("red_can", "table")}
    history = History(seen(["duck", "white_cube", "red_can"], on, 4), happened, start.initial)
    found = diagnose(start.description, history)
    assert (found.outcome, found.explanations) == (DiagnosisOutcome.EXPECTED, ((),))


def test_what_no_event_of_the_domain_explains_is_unexplained():
    start, happened = trace_1()
    on = {("duck", "table"), ("white_cube", "red_can"), ("red_can", "table")}
    history = History(seen(["duck", "white_cube", "red_can"], on, 4), happened, start.initial)
    assert diagnose(start.description, history).outcome is DiagnosisOutcome.UNEXPLAINED


def test_all_smallest_explanations_are_found_and_no_larger_ones():
    start = situation(scene(["ab", "cd"]))
    pickup, putdown = (
        start.action(each)
        for each in map(start.planned, plan(start.task(start.goal("on(b, d)"))).plans[0].actions)
    )
    happened = (Happened(pickup, 0), Happened(putdown, 1))
    # d lies on the table in the end, and nobody saw when it fell; b, then on it, lies there too.
    observed = tuple(
        Observation(Atom("on", (Constant(name), Constant("table"))), True, 2) for name in "bd"
    )
    found = diagnose(start.description, History(observed, happened, start.initial))
    assert {tuple(map(str, events)) for events in found.explanations} == {
        ("fall(d) at step 0", "fall(b) at step 1"),
        ("fall(b) at step 1", "fall(d) at step 1"),
    }
    few = diagnose(start.description, History(observed, happened, start.initial), most=1)
    assert (len(few.explanations), few.complete) == (1, False)


def test_a_diagnosis_that_gets_no_time_says_so():
    start, happened = trace_1()
    history = History((), happened, start.initial)
    assert diagnose(start.description, history, 1e-9).outcome is DiagnosisOutcome.TIMED_OUT


def test_projection_tells_what_follows_from_the_actions():
    start, happened = trace_1()
    states = project(
        start.description, start.initial, [each.action for each in happened], ("on", "in_hand")
    )
    assert [sorted(map(str, state)) for state in states] == [
        ["on(duck, white_cube)", "on(red_can, table)", "on(white_cube, red_can)"],
        ["in_hand(rob1, duck)", "on(red_can, table)", "on(white_cube, red_can)"],
        ["on(duck, table)", "on(red_can, table)", "on(white_cube, red_can)"],
        ["in_hand(rob1, white_cube)", "on(duck, table)", "on(red_can, table)"],
        ["on(duck, table)", "on(red_can, table)", "on(white_cube, duck)"],
    ]


@pytest.mark.parametrize("withheld", [(), LEARNED])
def test_an_uncovered_object_is_neither_stable_nor_unstable_in_any_step(withheld):
    """Estimated fluents have no inertia and no closed world: where no axiom speaks, none holds."""
    start = situation(scene(["ab", "c"]), withheld)
    found = plan(start.task(start.goal("on(b, c)"))).plans[0]
    states = project(start.description, start.initial, found.actions, ("stable", "occluded"))
    about_b = [sorted(str(each) for each in state if "(b)" in str(each)) for state in states]
    # In the hand, b is above nothing and behind nothing.
    held = [] if withheld else ["-occluded(b)", "stable(b)"]
    there = [] if withheld else ["-occluded(b)"]
    assert about_b == [there, held, there]


def test_what_contradicts_itself_has_no_states():
    start = situation(scene(["a", "b"]))
    wrong = start.description.with_facts(
        fact for each in start.description.facts for fact in (each, each.complement)
    )
    with pytest.raises(ReasoningError, match="contradict"):
        project(wrong, start.initial, [], ("small_base",))
