"""Without what an action is impossible; and plans of domains in which that matters."""

from __future__ import annotations

import pytest

from ros_scenesense.knowledge.action_language import parse, parse_goal
from ros_scenesense.knowledge.literals import Atom
from ros_scenesense.knowledge.prerequisites import prerequisites
from ros_scenesense.knowledge.terms import Variable
from ros_scenesense.reasoning.planning import PlanningLimits, PlanningTask, plan

DOMAIN = """
sort thing. sort key < thing = {k1, k2}. sort rock < thing = {stone}. sort hand = {left, right}.
inertial fluent has(hand, thing), charged(key), open(thing).
action take(hand, thing), use(hand, thing), swap(thing, thing).
take(H, T) causes has(H, T).
use(H, T) causes open(T).
"""
HAND, THING = Variable("X0"), Variable("X1")
USE = Atom("use", (HAND, THING))


def needed(axiom: str, action: Atom = USE) -> list[str]:
    description = parse(DOMAIN + axiom).description
    return list(map(str, prerequisites(action, description.axioms, description.signature)))


def test_what_an_action_needs_is_told_in_its_own_variables():
    assert needed("impossible use(H, T) if not has(H, T).") == ["has(X0, X1)"]
    assert needed("impossible swap(A, B) if not open(B).", Atom("swap", (HAND, THING))) == [
        "open(X1)"
    ]


@pytest.mark.parametrize(
    "axiom",
    [
        "impossible use(H, T) if has(H, T).",
        "impossible use(H, T) if -has(H, T).",
        "impossible use(H, T) if not has(H, T), open(T).",
        "impossible use(H, T) if not has(H, X).",
        "impossible use(H, T) if not open(stone).",
        "impossible use(left, T) if not has(left, T).",
        "impossible take(H, T) if not has(H, T).",
        "impossible use(H, T), take(H, T) if not has(H, T).",
        "impossible use(H, T) if not charged(T).",  # a stone is not charged, and can be used
    ],
)
def test_what_is_not_needed_by_every_instance_is_none(axiom):
    assert needed(axiom) == []


def test_an_action_with_one_argument_twice_does_not_tell_of_others():
    assert needed("impossible swap(A, A) if not open(A).", Atom("swap", (HAND, THING))) == []


@pytest.mark.parametrize(
    ("axiom", "thing", "length"),
    [
        ("impossible use(H, T) if not has(H, T).", "stone", 2),
        ("impossible use(H, T) if not has(H, T).", "k1", 2),
        ("impossible use(H, T) if not charged(T).", "stone", 1),
    ],
)
def test_plans_do_what_is_needed_first(axiom, thing, length):
    description = parse(DOMAIN + axiom).description
    goal = parse_goal(f"open({thing})", description)
    found = plan(PlanningTask(description, (), goal), PlanningLimits(every=True))
    assert [len(each.actions) for each in found.plans] == [length, length]  # with either hand
