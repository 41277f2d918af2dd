"""Converse relations are said by one of the two, and only where that changes nothing."""

import pytest

from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.converses import Converses
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.reasoning.situations import robot_domain

DOMAIN = """
sort thing = {a, b}.
inertial fluent over(thing, thing), under(thing, thing).
action part(thing), lift(thing, thing).
over(X, Y) if under(Y, X).
under(X, Y) if over(Y, X).
lift(X, Y) causes over(X, Y).
impossible part(X) if not under(X, Y).
"""
BOTH_FALL = "part(X) causes -over(X, Y), -under(Y, X)."


def literal(name: str) -> Literal:
    return Literal(Atom(name, (Constant("a"), Constant("b"))))


def test_the_relations_of_the_robots_domain_are_halved():
    converses = Converses(robot_domain())
    said = {name: str(converses.literal(literal(name))) for name in ("below", "front", "left")}
    assert said == {"below": "above(b, a)", "front": "front(a, b)", "left": "right(b, a)"}
    assert str(converses.literal(literal("behind").complement)) == "-front(b, a)"
    assert str(converses.literal(literal("touching"))) == "touching(a, b)"
    text = "\n".join(map(str, converses.description.axioms))
    assert " below(" not in text
    assert " behind(" not in text


def test_what_a_statement_says_of_a_converse_is_said_of_the_other():
    description = parse(DOMAIN + BOTH_FALL).description
    axioms = list(map(str, Converses(description).description.axioms))
    assert axioms == [
        "lift(X, Y) causes over(X, Y).",
        "impossible part(X) if not over(Y, X).",
        "part(X) causes -over(X, Y).",
    ]


@pytest.mark.parametrize(
    "more",
    [
        "part(X) causes -over(X, Y).",
        "part(X) causes -over(X, Y), -under(Y, X) if over(X, Y). part(X) causes -under(X, Y).",
        BOTH_FALL + " -over(X, X) if over(X, Y).",
    ],
)
def test_relations_of_which_one_may_become_false_alone_are_kept(more):
    description = parse(DOMAIN + more).description
    assert Converses(description).description == description


def test_a_relation_that_only_implies_another_is_kept():
    text = DOMAIN.replace("over(X, Y) if under(Y, X).", "") + BOTH_FALL
    description = parse(text).description
    assert Converses(description).description == description
