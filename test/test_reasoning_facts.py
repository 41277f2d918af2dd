from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Collection

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
from ros_scenesense.reasoning.program import Selection
from ros_scenesense.reasoning.random_facts import random_facts
from ros_scenesense.scene import Distance, Position, Size, Surface


def asking(*names: str, uncertain: Collection[str] = ()) -> Selection:
    used = frozenset((name, 2) for name in names)
    return Selection((), (), used, frozenset(), frozenset(uncertain))


EVERYTHING = asking("obj_size", "obj_surface", *map(str, (*Position, *Distance)))
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
    assert facts.render(EVERYTHING) == (
        "object(0..1).obj_size(0,small).obj_size(1,large).obj_surface(0,flat)."
        "above(1,0).touching(1,0)."
    )
    assert [each.atom for each in facts.statements(EVERYTHING)] == [
        "obj_size(0,small)",
        "obj_size(1,large)",
        "obj_surface(0,flat)",
        "above(1,0)",
        "touching(1,0)",
    ]


def test_rendering_leaves_out_what_the_program_does_not_ask_for() -> None:
    facts = random_facts(8, np.random.default_rng(0))
    used = facts.render(asking("below", "obj_size"))
    names = {fact.split("(")[0] for fact in used.split(".") if fact}
    assert names == {"object", "7)", "obj_size", "below"}


def unknown(facts: SceneFacts, *names: str) -> set[str]:
    text = facts.render(asking(uncertain=names))
    return {fact[8:-1] for fact in text.split(".") if fact.startswith("unknown(")}


def test_what_is_not_known_of_a_pair_is_unknown_in_both_directions() -> None:
    facts = SceneFacts((A, B, C), (relation("a", "b"), relation("c", "a")))
    assert unknown(facts, "above") == {"above(1,2)", "above(2,1)"}
    assert not facts.is_complete(asking(uncertain=["above"]))
    assert facts.is_complete(asking("above"))
    complete = SceneFacts((A, B, C), (*facts.relations, relation("c", "b")))
    assert complete.is_complete(asking(uncertain=["above", "behind"]))


def test_what_nobody_sees_may_be_below_what_is_seen_but_not_in_front_of_it() -> None:
    facts = SceneFacts((A, SceneObject("hidden", located=False)), ())
    assert unknown(facts, "above") == {"above(0,1)", "above(1,0)"}
    assert unknown(facts, "behind") == {"behind(1,0)"}
    assert unknown(facts, "front") == {"front(0,1)"}


def test_an_attribute_that_is_not_known_may_have_any_value() -> None:
    facts = SceneFacts((SceneObject("a", size=Size.SMALL), SceneObject("b")), ())
    assert unknown(facts, "obj_size") == {f"obj_size(1,{size})" for size in Size}
    denied = dataclasses.replace(asking("obj_size"), denied=frozenset({("obj_size", 2)}))
    assert facts.render(denied) == (
        "object(0..1).obj_size(0,small).-obj_size(0,medium).-obj_size(0,large)."
    )


def test_relations_can_be_withdrawn_one_by_one() -> None:
    pair = PairRelation("a", "b", Position.ABOVE, Distance.TOUCHING, 0.25, 0.5)
    asked = asking("above", "touching", uncertain=["behind", "far"])
    text = SceneFacts((A, B), (pair,)).render(asked, retractable=True)
    assert text == (
        "object(0..1)."
        "perceived(0,250).above(0,1):-not retracted(0)."
        "unknown(behind(0,1)):-retracted(0).unknown(behind(1,0)):-retracted(0)."
        "perceived(1,500).touching(0,1):-not retracted(1)."
        "unknown(far(0,1)):-retracted(1).unknown(far(1,0)):-retracted(1)."
    )


def test_foreign_text_in_place_of_an_enum_member_is_not_written() -> None:
    bad = PairRelation("a", "b", "x). bad(", Distance.FAR)  # type: ignore[arg-type]
    assert "bad" not in SceneFacts((A, B), (bad,)).render(EVERYTHING)


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
