from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Collection

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.reasoning.classification import Classification, ClassificationSession
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject
from ros_scenesense.reasoning.program import Program
from ros_scenesense.reasoning.random_facts import random_facts
from ros_scenesense.scene import DecisionStatus, Distance, Position, Size, Surface, find_structures

SESSION = ClassificationSession(Program.shipped(), time_limit_s=60.0)
KINDS = {axiom.id: axiom.kind for axiom in SESSION.program.axioms}
AXIOMS = list(KINDS)


# --- A plain evaluator of the same axioms, by their definitions, to hold the session against.


class Evaluator:
    def __init__(self, facts: SceneFacts) -> None:
        self.objects = {each.name: each for each in facts.objects}
        self.relations = {
            each for one in facts.relations for each in (one, _reversed(one)) if each is not None
        }
        self.drop_circles()
        located = {each.name for each in facts.objects if each.located}
        self.surveyed = {
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

    def below(self, name: str) -> set[str]:
        """Everything that carries `name`, directly or through others."""
        found: set[str] = set()
        while True:
            more = found | self.on(name) | {x for each in found for x in self.on(each)}
            if more == found:
                return found
            found = more

    def drop_circles(self) -> None:
        on_circle = {name: name in self.below(name) for name in self.objects}
        dropped = [
            {upper, lower}
            for upper in self.objects
            for lower in self.on(upper)
            if on_circle[upper] and (upper == lower or upper in self.below(lower))
        ]
        self.relations = {r for r in self.relations if {r.object, r.reference} not in dropped}

    def levels(self, name: str) -> set[int]:
        base = {1} if name in self.surveyed and not self.on(name) else set()
        return base | {level + 1 for lower in self.on(name) for level in self.levels(lower)}

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
        if name in self.surveyed and not behind:
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


def beliefs_of(result: Classification) -> dict[str, tuple[Belief, Belief]]:
    return {each.name: (each.stable, each.occluded) for each in result.objects}


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
    result = SESSION.classify(facts, withheld)
    plain = Evaluator(facts)
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
    assert SESSION.classify(shuffled) == SESSION.classify(facts)


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
    assume(not result.ignored)
    full = beliefs_of(result)
    for name, beliefs in beliefs_of(SESSION.classify(less)).items():
        for before, now in zip(full[name], beliefs, strict=True):
            assert set(now.axioms) <= set(before.axioms)
            assert now.value in (before.value, None)


# --- Single cases.


def stack(*objects: SceneObject) -> SceneFacts:
    """Objects that stand on each other, the lowest first."""
    relations = [
        PairRelation(
            objects[upper].name,
            objects[lower].name,
            Position.ABOVE,
            Distance.TOUCHING if upper == lower + 1 else Distance.NOT_TOUCHING,
        )
        for lower, upper in itertools.combinations(range(len(objects)), 2)
    ]
    return SceneFacts(objects, tuple(relations))


def stable(facts: SceneFacts, name: str, withheld: Collection[str] = ()) -> Belief:
    return beliefs_of(SESSION.classify(facts, withheld))[name][0]


def test_a_scene_without_objects() -> None:
    assert SESSION.classify(SceneFacts((), ())) == Classification(objects=())


def test_an_irregular_surface_below_makes_the_structure_strictly_unstable() -> None:
    facts = stack(
        SceneObject("duck", surface=Surface.IRREGULAR), SceneObject("cube"), SceneObject("can")
    )
    result = SESSION.classify(facts)
    assert [(e.stable.status, e.stable.value, e.stable.axioms) for e in result.objects] == [
        (DecisionStatus.STRICT, True, ["s1"]),
        (DecisionStatus.STRICT, False, ["s2"]),
        (DecisionStatus.STRICT, False, ["s2"]),
    ]
    [structure] = result.structures
    assert structure.members == ["can", "cube", "duck"]
    assert structure.stable == Belief(status=DecisionStatus.STRICT, value=False, axioms=["s2"])


def test_only_what_stands_above_the_fourth_level_is_too_high() -> None:
    facts = stack(*(SceneObject(f"level {level}") for level in range(1, 12)))
    axioms = [stable(facts, each.name).axioms for each in facts.objects]
    assert axioms == [["s1"], [], [], []] + [["tall_tower"]] * 7


def test_a_tower_whose_foot_may_stand_on_something_has_no_known_height() -> None:
    tower = stack(*(SceneObject(f"level {level}") for level in range(1, 7)))
    beside = tuple(
        PairRelation("beside", each.name, Position.LEFT, Distance.FAR) for each in tower.objects[1:]
    )
    facts = SceneFacts((*tower.objects, SceneObject("beside")), tower.relations + beside)
    assert stable(tower, "level 6").axioms == ["tall_tower"]
    assert stable(facts, "level 6").status is DecisionStatus.UNDECIDED


def test_large_on_small_is_unstable_by_default() -> None:
    large = SceneObject("large", size=Size.LARGE)
    facts = stack(SceneObject("small", size=Size.SMALL), large)
    assert stable(facts, "large", ["s3"]) == Belief(
        status=DecisionStatus.BY_DEFAULT, value=False, axioms=["large_on_small"]
    )
    medium = stack(SceneObject("small", size=Size.SMALL), SceneObject("medium", size=Size.MEDIUM))
    assert stable(medium, "medium").axioms == ["s3"]


def test_of_an_object_that_is_not_located_nothing_is_concluded_from_absence() -> None:
    hidden = SceneObject("hidden", located=False, size=Size.SMALL, surface=Surface.FLAT)
    facts = SceneFacts((SceneObject("cube"), hidden), ())
    found = beliefs_of(SESSION.classify(facts))
    assert {each.status for each in found["hidden"]} == {DecisionStatus.UNDECIDED}
    assert {each.status for each in found["cube"]} == {DecisionStatus.STRICT}

    # What a person says of it still counts.
    said = PairRelation("hidden", "cube", Position.BEHIND, Distance.TOUCHING)
    duck = SceneObject("duck", surface=Surface.IRREGULAR)
    on_duck = PairRelation("hidden", "duck", Position.ABOVE, Distance.TOUCHING)
    facts = SceneFacts((SceneObject("cube"), duck, hidden), (said, on_duck))
    stability, occlusion = beliefs_of(SESSION.classify(facts))["hidden"]
    assert (stability.value, stability.axioms) == (False, ["s2"])
    assert (occlusion.value, occlusion.axioms) == (False, ["o2"])


def test_objects_in_a_circle_are_undecided_and_the_rest_is_not() -> None:
    circle = [("a", "b"), ("b", "c"), ("c", "a")]
    facts = SceneFacts(
        tuple(SceneObject(name, surface=Surface.IRREGULAR) for name in "abcd"),
        tuple(
            PairRelation(*pair, Position.ABOVE, Distance.TOUCHING) for pair in [*circle, ("d", "a")]
        )
        + tuple(PairRelation("d", other, Position.ABOVE, Distance.FAR) for other in "bc"),
    )
    result = SESSION.classify(facts)
    assert result.ignored == {frozenset(pair) for pair in circle}
    values = {name: each[0].value for name, each in beliefs_of(result).items()}
    assert values == {"a": None, "b": None, "c": None, "d": False}
    assert [(each.object, each.reference) for each in result.derived] == [("d", "a")]


HEAD = """
#defined enabled/1. #defined surveyed/1. #defined size/2.
pos(F) :- pos(F, _).  neg(F) :- neg(F, _).
axiom(p1, normal, "").   axiom(p2, default, "").   axiom(n1, default, "").
"""
ONE = SceneFacts((SceneObject("a", size=Size.SMALL), SceneObject("b")), ())


def classify(rules: str, facts: SceneFacts = ONE, time_limit_s: float = 60.0) -> Classification:
    return ClassificationSession(Program(HEAD + rules), time_limit_s).classify(facts)


OPPOSING = """
pos(stable(A), p1) :- enabled(p1), size(A, _), not neg(stable(A)).
neg(stable(A), n1) :- enabled(n1), size(A, _), not pos(stable(A)).
pos(occluded(A), p2) :- enabled(p2), size(A, _).
"""


def test_opposing_defaults_with_several_answer_sets_leave_it_undecided() -> None:
    result = classify(OPPOSING)
    assert result.objects[0].stable == Belief(status=DecisionStatus.UNDECIDED)
    assert result.objects[0].occluded.value is True


def test_what_holds_in_all_answer_sets_by_different_axioms_is_believed_by_default() -> None:
    result = classify(
        """{ choice }.
        pos(stable(A), p1) :- enabled(p1), size(A, _), choice.
        pos(stable(A), p2) :- enabled(p2), size(A, _), not choice.
        neg(occluded(A), n1) :- enabled(n1), size(A, _)."""
    )
    assert result.objects[0].stable == Belief(status=DecisionStatus.BY_DEFAULT, value=True)
    assert result.objects[0].occluded.axioms == ["n1"]


def test_a_contradiction_spoils_one_object_only() -> None:
    result = classify(
        """pos(stable(A), p1) :- enabled(p1), A = 0..1, enabled(_).
        neg(stable(A), n1) :- enabled(n1), size(A, small).
        pos(occluded(A), p2) :- enabled(p2), size(A, _)."""
    )
    first, second = (each.stable for each in result.objects)
    assert first == Belief(status=DecisionStatus.INCONSISTENT, axioms=["p1", "n1"])
    assert second == Belief(status=DecisionStatus.STRICT, value=True, axioms=["p1"])


def test_without_any_answer_set_every_object_is_inconsistent() -> None:
    result = classify(OPPOSING + ":- size(_, small).")
    assert {each.stable.status for each in result.objects} == {DecisionStatus.INCONSISTENT}
    assert result.structures == ()


def test_a_search_that_takes_too_long_is_given_up() -> None:
    pigeons = """
    { in_hole(P, H) : H = 1..11 } = 1 :- P = 1..12.
    :- in_hole(P, H), in_hole(Q, H), P < Q.
    """
    result = classify(OPPOSING + pigeons, time_limit_s=0.02)
    assert {each.stable.status for each in result.objects} == {DecisionStatus.TIMED_OUT}
    assert {each.occluded.status for each in result.objects} == {DecisionStatus.TIMED_OUT}


def test_the_solver_writes_nothing_to_the_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    classify(OPPOSING + "extra(X + 1) :- size(_, X).")
    assert capfd.readouterr() == ("", "")
