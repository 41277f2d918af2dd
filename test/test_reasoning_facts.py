from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.reasoning.facts import (
    PairRelation,
    SceneFacts,
    SceneObject,
    cyclic_pairs,
)
from ros_scenesense.reasoning.random_facts import random_facts
from ros_scenesense.scene import Distance, Position, Size, Surface

EVERYTHING = frozenset(
    {("size", 2), ("surface", 2), *((str(r), 2) for r in (*Position, *Distance))}
)
A, B, C = (SceneObject(name) for name in "abc")


def relation(
    upper: str, lower: str, position: Position = Position.ABOVE, touching: bool = True
) -> PairRelation:
    distance = Distance.TOUCHING if touching else Distance.FAR
    return PairRelation(upper, lower, position, distance)


def test_rendering_writes_integers_and_our_own_words() -> None:
    facts = SceneFacts(
        (
            SceneObject("a). bad(", size=Size.SMALL, surface=Surface.FLAT),
            SceneObject("b", located=False, size=Size.LARGE),
        ),
        (relation("b", "a). bad("),),
    )
    assert facts.render(["s1"], EVERYTHING) == (
        "enabled(s1).surveyed(0).size(0,small).size(1,large).surface(0,flat)."
        "above(1,0).touching(1,0)."
    )


def test_rendering_leaves_out_what_the_program_does_not_ask_for() -> None:
    facts = random_facts(8, np.random.default_rng(0))
    used = facts.render([], frozenset({("below", 2), ("size", 2)}))
    assert {fact.split("(")[0] for fact in used.split(".") if fact} == {"surveyed", "size", "below"}


def test_an_object_is_surveyed_only_if_its_relation_to_all_located_objects_is_known() -> None:
    hidden = SceneObject("hidden", located=False)
    facts = SceneFacts((A, B, C, hidden), (relation("a", "b"), relation("c", "a")))
    assert "surveyed(0)" in facts.render([], EVERYTHING)
    assert "surveyed(1)" not in facts.render([], EVERYTHING)
    assert "surveyed(3)" not in facts.render([], EVERYTHING)


def test_foreign_text_in_place_of_an_enum_member_is_not_written() -> None:
    bad = PairRelation("a", "b", "x). bad(", Distance.FAR)  # type: ignore[arg-type]
    assert "bad" not in SceneFacts((A, B), (bad,)).render([], EVERYTHING)


ABOVE, BELOW_AGAIN = relation("a", "b"), relation("b", "a", Position.BELOW)
CONTRADICTIONS = [
    relation("a", "b", Position.LEFT),
    relation("a", "b", touching=False),
    relation("b", "a"),
    relation("b", "a", Position.IN),
]


@pytest.mark.parametrize(
    ("relations", "kept", "kinds"),
    [
        ([ABOVE], [ABOVE], []),
        ([ABOVE, ABOVE], [ABOVE], ["relation_repeated"]),
        ([ABOVE, BELOW_AGAIN], [ABOVE], ["relation_repeated"]),
        *(([ABOVE, other], [], ["relation_contradictory"]) for other in CONTRADICTIONS),
        ([ABOVE, CONTRADICTIONS[0], ABOVE], [], ["relation_contradictory"] * 2),
        ([relation("a", "ghost"), ABOVE], [ABOVE], ["relation_of_unknown_object"]),
        ([relation("a", "a"), ABOVE], [ABOVE], ["relation_to_itself"]),
    ],
)
def test_wrong_relations_are_named_and_left_out(
    relations: list[PairRelation], kept: list[PairRelation], kinds: list[str]
) -> None:
    _, problems = SceneFacts.checked([A, B], relations)
    assert [each.kind for each in problems] == kinds
    assert all("'a'" in each.words for each in problems)
    for order in itertools.permutations(relations):
        facts, _ = SceneFacts.checked([A, B], order)
        assert {each.pair for each in facts.relations} == {each.pair for each in kept}


def test_objects_that_share_a_name_are_one_of_which_nothing_is_known() -> None:
    objects = [SceneObject("a", size=Size.SMALL), B, SceneObject("a"), SceneObject("a")]
    facts, problems = SceneFacts.checked(objects, [ABOVE, relation("b", "ghost")])
    assert facts.objects == (SceneObject("a", located=False), B)
    assert facts.relations == ()
    assert [each.kind for each in problems] == [
        "object_repeated",
        "relation_of_repeated_object",
        "relation_of_unknown_object",
    ]


edges = st.lists(st.tuples(*[st.sampled_from("abcdef")] * 2).filter(lambda e: e[0] != e[1]))


@given(edges)
def test_cyclic_pairs_are_those_from_which_a_path_leads_back(edges: list[tuple[str, str]]) -> None:
    def leads(start: str, end: str, through: frozenset[str] = frozenset()) -> bool:
        return start == end or any(
            leads(lower, end, through | {start})
            for upper, lower in edges
            if upper == start and lower not in through
        )

    expected = {frozenset(edge) for edge in edges if leads(edge[1], edge[0])}
    assert cyclic_pairs(edges) == expected


def test_random_facts_are_complete_and_reproducible() -> None:
    facts = random_facts(9, np.random.default_rng(3))
    assert facts == random_facts(9, np.random.default_rng(3))
    assert facts != random_facts(9, np.random.default_rng(4))
    assert len(facts.objects) == 9
    assert len({each.pair for each in facts.relations}) == len(facts.relations) == 36
    assert SceneFacts.checked(facts.objects, facts.relations) == (facts, [])
    assert random_facts(0, np.random.default_rng(0)) == SceneFacts((), ())
