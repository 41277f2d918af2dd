"""The classification session agrees with a plain evaluator of the same axioms, on any scene."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Collection

import numpy as np
import pytest
from classification_samples import AXIOMS, KINDS, SESSION, beliefs_of
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.reasoning.facts import (
    PairRelation,
    SceneFacts,
    SceneObject,
)
from ros_scenesense.reasoning.random_facts import random_facts
from ros_scenesense.scene import (
    DecisionStatus,
    Distance,
    Position,
    Size,
    Surface,
    find_structures,
)

# --- A plain evaluator of the same axioms, by their definitions, to hold the session against.


class Evaluator:
    def __init__(self, facts: SceneFacts) -> None:
        self.objects = {each.name: each for each in facts.objects}
        self.relations = {
            each for one in facts.relations for each in (one, _reversed(one)) if each is not None
        }
        names = set(self.objects)
        self.surveyed = {
            name for name in names if all(self.related(name, other) for other in names - {name})
        }
        # What nobody sees is hidden by what is seen, and hides nothing that is seen.
        located = {each.name for each in facts.objects if each.located}
        self.in_view = self.surveyed | {
            name for name in located if all(self.related(name, other) for other in located - {name})
        }

    def related(self, one: str, other: str) -> bool:
        return any({r.object, r.reference} == {one, other} for r in self.relations)

    def to(self, name: str, position: Position) -> set[str]:
        """The objects to which `name` stands in this relation."""
        return {r.reference for r in self.relations if (r.object, r.position) == (name, position)}

    def on(self, name: str) -> set[str]:
        return {
            r.reference
            for r in self.relations
            if (r.object, r.position, r.distance) == (name, Position.ABOVE, Distance.TOUCHING)
        }

    def carriers(self, name: str) -> set[str]:
        """Everything that `name` is on or in, directly or through others."""
        found: set[str] = set()
        while True:
            reached = {name, *found}
            more = {x for each in reached for x in self.on(each) | self.to(each, Position.IN)}
            if more <= found:
                return found
            found |= more

    def below(self, name: str) -> set[str]:
        """Everything that carries `name`, directly or through others."""
        found: set[str] = set()
        while True:
            more = found | self.on(name) | {x for each in found for x in self.on(each)}
            if more == found:
                return found
            found = more

    def has_circle(self) -> bool:
        return any(name in self.carriers(name) for name in self.objects)

    def levels(self, name: str) -> set[int]:
        """The levels in its stack; what is in something is at its level."""
        on, within = self.on(name), self.to(name, Position.IN)
        base = {1} if name in self.surveyed and not on and not within else set()
        higher = {level + 1 for lower in on for level in self.levels(lower)}
        return base | higher | {each for outer in within for each in self.levels(outer)}

    def is_stable(self, name: str) -> dict[str, bool]:
        size = {other: each.size for other, each in self.objects.items()}
        below = [self.objects[other] for other in self.below(name)]
        found = {}
        if name in self.surveyed and not self.to(name, Position.ABOVE):
            found["s1"] = True
        if any(each.surface is Surface.IRREGULAR for each in below):
            found["s2"] = False
        if "s1" not in found:
            if any(each.size is Size.SMALL for each in below):
                found["s3"] = False
            on_small = any(size[other] is Size.SMALL for other in self.on(name))
            if size[name] is Size.LARGE and on_small:
                found["large_on_small"] = False
            if any(level > 4 for level in self.levels(name)):
                found["tall_tower"] = False
        return found

    def is_occluded(self, name: str) -> dict[str, bool]:
        behind, above = self.to(name, Position.BEHIND), self.to(name, Position.ABOVE)
        found = {}
        if name in self.in_view and not behind:
            found["o1"] = False
        if behind and above:
            found["o2"] = False
        if name in self.surveyed and behind and not above:
            found["o3"] = True
        return found

    def beliefs(self, withheld: Collection[str]) -> dict[str, tuple[Belief, Belief]]:
        return {
            name: (
                expected_belief(self.is_stable(name), withheld),
                expected_belief(self.is_occluded(name), withheld),
            )
            for name in self.objects
        }


def _reversed(one: PairRelation) -> PairRelation | None:
    if one.position.converse is None:
        return None
    return PairRelation(one.reference, one.object, one.position.converse, one.distance)


def expected_belief(conclusions: dict[str, bool], withheld: Collection[str]) -> Belief:
    by = [axiom for axiom in AXIOMS if axiom in conclusions and axiom not in withheld]
    if not by:
        return Belief(status=DecisionStatus.UNDECIDED)
    [value] = {conclusions[axiom] for axiom in by}
    strict = any(KINDS[axiom] == "normal" for axiom in by)
    status = DecisionStatus.STRICT if strict else DecisionStatus.BY_DEFAULT
    return Belief(status=status, value=value, axioms=by)


# --- Scenes.

# Weighted towards stacks: among all relations alike, chains of `on` would hardly come up.
positions = st.one_of(
    st.sampled_from([Position.ABOVE, Position.BELOW]), st.sampled_from(list(Position))
)
distances = st.one_of(st.just(Distance.TOUCHING), st.sampled_from(list(Distance)))
sizes = st.none() | st.sampled_from(list(Size))
surfaces = st.none() | st.sampled_from(list(Surface))


@st.composite
def scenes(draw: st.DrawFn, complete: bool = False) -> SceneFacts:
    names = [f"object {index}" for index in range(draw(st.integers(0, 6)))]
    located = st.just(True) if complete else st.sampled_from([True, True, True, False])
    objects = [SceneObject(name, draw(located), draw(sizes), draw(surfaces)) for name in names]
    relations = []
    for pair in itertools.combinations(names, 2):
        if complete or draw(st.sampled_from([True, True, True, False])):
            one, other = draw(st.permutations(pair))
            relations.append(PairRelation(one, other, draw(positions), draw(distances)))
    return SceneFacts(tuple(objects), tuple(relations))


withholdings = st.sets(st.sampled_from(AXIOMS))


@settings(max_examples=100, deadline=None)
@given(scenes(), withholdings)
def test_the_session_agrees_with_the_plain_evaluator(facts: SceneFacts, withheld: set[str]) -> None:
    plain = Evaluator(facts)
    assume(not plain.has_circle())
    result = SESSION.classify(facts, withheld)
    assert result.retracted == ()
    assert beliefs_of(result) == plain.beliefs(withheld)
    on = {(upper, lower) for upper in plain.objects for lower in plain.on(upper)}
    assert {(each.object, each.reference) for each in result.derived} == on
    assert {each.relation for each in result.derived} <= {"on"}
    assert [tuple(each.members) for each in result.structures] == find_structures(plain.objects, on)


@pytest.mark.parametrize("seed", range(15))
def test_the_session_agrees_with_the_plain_evaluator_on_stacks(seed: int) -> None:
    facts = random_facts(12, np.random.default_rng(seed))
    assert beliefs_of(SESSION.classify(facts)) == Evaluator(facts).beliefs(())


@settings(max_examples=30, deadline=None)
@given(scenes(), st.randoms(use_true_random=False))
def test_the_order_of_relations_and_their_direction_change_nothing(
    facts: SceneFacts, random: object
) -> None:
    relations = [
        (_reversed(each) or each) if random.random() < 0.5 else each  # type: ignore[attr-defined]
        for each in facts.relations
    ]
    random.shuffle(relations)  # type: ignore[attr-defined]
    shuffled = dataclasses.replace(facts, relations=tuple(relations))
    expected, found = SESSION.classify(facts), SESSION.classify(shuffled)
    assert dataclasses.replace(found, retracted=expected.retracted) == expected
    withdrawn = [
        sorted(sorted((each.object, each.reference)) for each in result.retracted)
        for result in (expected, found)
    ]
    assert withdrawn[0] == withdrawn[1]


HOSTILE = [
    "a). bad(",
    'quote" ',
    "new\nline",
    "%* comment",
    "Große Kiste \N{DUCK}",
    "#script(python)",
]


@settings(max_examples=30, deadline=None)
@given(
    scenes(),
    st.lists(st.sampled_from(HOSTILE) | st.text(min_size=1), min_size=6, max_size=6, unique=True),
)
def test_names_are_only_names(facts: SceneFacts, names: list[str]) -> None:
    renamed = {each.name: name for each, name in zip(facts.objects, names, strict=False)}
    hostile = SceneFacts(
        tuple(dataclasses.replace(each, name=renamed[each.name]) for each in facts.objects),
        tuple(
            dataclasses.replace(
                each, object=renamed[each.object], reference=renamed[each.reference]
            )
            for each in facts.relations
        ),
    )
    expected, found = SESSION.classify(facts), SESSION.classify(hostile)
    assert beliefs_of(found) == {
        renamed[name]: beliefs for name, beliefs in beliefs_of(expected).items()
    }
    assert {(each.object, each.reference) for each in found.derived} == {
        (renamed[each.object], renamed[each.reference]) for each in expected.derived
    }


@settings(max_examples=30, deadline=None)
@given(scenes(), withholdings)
def test_withholding_axioms_takes_away_exactly_what_only_they_conclude(
    facts: SceneFacts, withheld: set[str]
) -> None:
    full, reduced = beliefs_of(SESSION.classify(facts)), SESSION.classify(facts, withheld)
    for name, after in beliefs_of(reduced).items():
        for before, now in zip(full[name], after, strict=True):
            remaining = [axiom for axiom in before.axioms if axiom not in withheld]
            assert now.axioms == remaining
            assert now.value == (before.value if remaining else None)


@settings(max_examples=30, deadline=None)
@given(scenes(complete=True), st.data())
def test_knowing_less_decides_less_and_never_differently(
    facts: SceneFacts, data: st.DataObject
) -> None:
    forgotten = st.booleans()
    less = SceneFacts(
        tuple(
            SceneObject(
                each.name,
                size=None if data.draw(forgotten) else each.size,
                surface=None if data.draw(forgotten) else each.surface,
            )
            for each in facts.objects
        ),
        tuple(each for each in facts.relations if not data.draw(forgotten)),
    )
    result = SESSION.classify(facts)
    # A relation that is forgotten may open a circle, whose other relations then count.
    assume(not result.retracted)
    full = beliefs_of(result)
    for name, beliefs in beliefs_of(SESSION.classify(less)).items():
        for before, now in zip(full[name], beliefs, strict=True):
            assert set(now.axioms) <= set(before.axioms)
            assert now.value in (before.value, None)
