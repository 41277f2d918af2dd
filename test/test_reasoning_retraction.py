"""Which perceived relations are withdrawn, held against trying all sets of them."""

from __future__ import annotations

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.reasoning.conflict import find_conflict
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject, cyclic_pairs
from ros_scenesense.reasoning.program import Program
from ros_scenesense.reasoning.retraction import retract
from ros_scenesense.reasoning.solving import Outcome
from ros_scenesense.scene import Distance, Position

PROGRAM = Program.shipped()
SELECTION = PROGRAM.selection(frozenset())

confidences = st.sampled_from([0.25, 0.5, 0.75])


@st.composite
def stacks(draw: st.DrawFn) -> SceneFacts:
    """Objects that stand on each other any way, also in circles."""
    names = "abcd"[: draw(st.integers(2, 4))]
    relations = []
    for pair in itertools.combinations(names, 2):
        one, other = draw(st.permutations(pair))
        relations.append(
            PairRelation(
                one,
                other,
                draw(st.sampled_from([Position.ABOVE, Position.ABOVE, Position.IN, Position.LEFT])),
                draw(st.sampled_from([Distance.TOUCHING, Distance.TOUCHING, Distance.FAR])),
                draw(confidences),
                draw(confidences),
            )
        )
    return SceneFacts(tuple(map(SceneObject, names)), tuple(relations))


def is_consistent(facts: SceneFacts, withdrawn: frozenset[int]) -> bool:
    """Whether nothing rests on or in itself without the relations of these numbers."""
    kept = {
        (each.object, each.reference, each.relation)
        for index, each in enumerate(facts.perceived(SELECTION.used))
        if index not in withdrawn
    }
    rests = [
        (one, other)
        for one, other, relation in kept
        if relation == "in" or (relation == "above" and (one, other, "touching") in kept)
    ]
    return not cyclic_pairs(rests)


def best(facts: SceneFacts) -> list[frozenset[int]]:
    """All smallest sets, of those the ones with the least confidence."""
    perceived = facts.perceived(SELECTION.used)
    numbers = range(len(perceived))
    for size in range(len(perceived) + 1):
        sets = map(frozenset, itertools.combinations(numbers, size))
        found = [each for each in sets if is_consistent(facts, each)]
        if found:
            cost = {each: sum(perceived[i].confidence for i in each) for each in found}
            return [each for each in found if cost[each] == min(cost.values())]
    raise AssertionError("withdrawing everything is always consistent")


@settings(max_examples=40, deadline=None)
@given(stacks())
def test_the_fewest_and_least_trusted_relations_are_withdrawn(facts: SceneFacts) -> None:
    retraction = retract(facts, SELECTION, "test", 60.0)
    expected = best(facts)
    assert retraction.outcome is Outcome.FOUND
    assert retraction.chosen in expected
    perceived = facts.perceived(SELECTION.used)
    union = sorted(frozenset().union(*expected))
    assert list(retraction.relations) == [perceived[index] for index in union]


def test_a_scene_without_a_contradiction_has_no_conflict() -> None:
    facts = SceneFacts((SceneObject("a"), SceneObject("b")), ())
    assert find_conflict(facts, SELECTION, "test") == ""
