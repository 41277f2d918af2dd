"""The session that classifies scenes: single cases, contradictions, and programs of its own."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Collection

import numpy as np
import pytest
from classification_samples import AXIOMS, SESSION, beliefs_of

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.axioms import Kind
from ros_scenesense.knowledge.classification import ClassificationRule
from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.reasoning.classification import Classification, ClassificationSession
from ros_scenesense.reasoning.facts import (
    PairRelation,
    PerceivedRelation,
    SceneFacts,
    SceneObject,
)
from ros_scenesense.reasoning.program import Axiom, Program
from ros_scenesense.reasoning.random_facts import random_facts
from ros_scenesense.scene import (
    DecisionStatus,
    Distance,
    Position,
    Size,
    Surface,
    Task,
)


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


def test_each_decision_has_a_short_explanation() -> None:
    facts = stack(SceneObject("duck", surface=Surface.IRREGULAR), SceneObject("{}. bad("))
    lower, upper = SESSION.classify(facts).objects
    assert lower.stable.why == "s1: not above(duck, B)"
    assert upper.stable.why == "s2: irregular_below({}. bad()"
    assert lower.occluded.why == "o1: not behind(duck, B)"


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
    assert structure.stable == Belief(
        status=DecisionStatus.STRICT,
        value=False,
        axioms=["s2"],
        why=result.objects[2].stable.why,
    )


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
    # The cube may stand on what nobody sees; but what nobody sees is not in front of it.
    stability, occlusion = found["cube"]
    assert stability.status is DecisionStatus.UNDECIDED
    assert (occlusion.status, occlusion.value) == (DecisionStatus.STRICT, False)

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
    assert {(each.object, each.reference) for each in result.retracted} == set(circle)
    values = {name: each[0].value for name, each in beliefs_of(result).items()}
    assert values == {"a": None, "b": None, "c": None, "d": False}
    assert [(each.object, each.reference) for each in result.derived] == [("d", "a")]


def learned(text: str) -> ClassificationSession:
    """A session that knows this one axiom about stability or occlusion, and the definitions."""
    program = Program.shipped().without(AXIOMS).extended({"learned": text})
    return ClassificationSession(program, time_limit_s=60.0)


@pytest.mark.parametrize("size", [None, *Size])
@pytest.mark.parametrize(
    ("text", "fires_on"),
    [
        ("stable(A) if on(A, B), not obj_size(B, small).", [Size.MEDIUM, Size.LARGE]),
        ("stable(A) if on(A, B), -obj_size(B, small).", [Size.MEDIUM, Size.LARGE]),
        ("stable(A) if on(A, B), not small_base(A).", [Size.MEDIUM, Size.LARGE]),
        ("stable(A) if on(A, B), -small_base(A).", [Size.MEDIUM, Size.LARGE]),
        ("-stable(A) if small_base(A).", [Size.SMALL]),
        ("stable(A) if on(A, B), not tower_height(A, 2).", []),
    ],
)
def test_no_axiom_fires_on_a_guess(text: str, fires_on: list[Size], size: Size | None) -> None:
    facts = stack(SceneObject("lower", size=size), SceneObject("upper"))
    result = beliefs_of(learned(text).classify(facts))["upper"][0]
    assert result.axioms == (["learned"] if size in fires_on else [])


def test_a_pair_that_is_not_known_is_no_reason() -> None:
    session = learned("stable(A) if on(A, B), not behind(A, C).")
    facts = stack(SceneObject("lower"), SceneObject("upper"))
    with_third = (*facts.objects, SceneObject("third"))
    third = PairRelation("third", "lower", Position.LEFT, Distance.FAR)
    beside = dataclasses.replace(third, reference="upper")
    for relations, axioms in (((third, beside), ["learned"]), ((third,), [])):
        scene = SceneFacts(with_third, (*facts.relations, *relations))
        assert beliefs_of(session.classify(scene))["upper"][0].axioms == axioms


def test_axioms_come_and_go_while_the_session_runs() -> None:
    session = learned("-occluded(A) if above(A, B).")
    facts = stack(SceneObject("lower"), SceneObject("upper"))

    def axioms() -> list[str]:
        return beliefs_of(session.classify(facts))["upper"][1].axioms

    assert axioms() == ["learned"]
    session.extend({"newer": "-occluded(A) if on(A, B)."})
    assert axioms() == ["learned", "newer"]
    with pytest.raises(LanguageError):
        session.extend({"broken": "-occluded(A) if no(A, B)."})
    session.remove(["learned"])
    assert axioms() == ["newer"]


def test_trace_2_the_general_axiom_decides_more_than_the_over_specified_one() -> None:
    """Paper, *Execution Trace* 2: an axiom with an unnecessary literal, and the general one."""
    over_specified = learned("-occluded(A) if not behind(A, B), above(A, C).")
    general = learned("-occluded(A) if not behind(A, B).")
    tower = stack(SceneObject("lower"), SceneObject("upper"))
    facts = SceneFacts(
        (*tower.objects, SceneObject("hidden")),
        (
            *tower.relations,
            PairRelation("hidden", "lower", Position.BEHIND, Distance.FAR),
            PairRelation("hidden", "upper", Position.BEHIND, Distance.FAR),
        ),
    )

    def decided(session: ClassificationSession, scene: SceneFacts) -> dict[str, bool]:
        beliefs = beliefs_of(session.classify(scene))
        return {n: each[1].value for n, each in beliefs.items() if each[1].value is not None}

    assert decided(over_specified, facts) == {"upper": False}
    assert decided(general, facts) == {"upper": False, "lower": False}
    # Whatever the scene, the general axiom decides all that the other does, and the same.
    gained = 0
    for seed in range(20):
        scene = random_facts(6, np.random.default_rng(seed))
        less, more = decided(over_specified, scene), decided(general, scene)
        assert less.items() <= more.items()
        gained += len(more) - len(less)
    assert gained > 0
    # Beside the general axiom the other adds nothing.
    both = learned("-occluded(A) if not behind(A, B).")
    both.extend({"over": "-occluded(A) if not behind(A, B), above(A, C)."})
    assert decided(both, facts) == decided(general, facts)


def relation(upper: str, lower: str, position: float = 1.0, distance: float = 1.0) -> PairRelation:
    return PairRelation(upper, lower, Position.ABOVE, Distance.TOUCHING, position, distance)


def test_the_least_trusted_relation_of_a_circle_is_withdrawn() -> None:
    facts = SceneFacts(
        tuple(SceneObject(name, surface=Surface.IRREGULAR) for name in "abc"),
        (relation("a", "b", 0.9), relation("b", "c", 0.9, 0.4), relation("c", "a", 0.8, 0.7)),
    )
    result = SESSION.classify(facts)
    [wrong] = result.retracted
    assert wrong == PerceivedRelation("touching", "b", "c", 0.4)
    # b is above c still, but perhaps does not touch it: a stands on b, c on a.
    assert {(each.object, each.reference) for each in result.derived} == {("a", "b"), ("c", "a")}
    values = {name: each[0].value for name, each in beliefs_of(result).items()}
    assert values == {"a": False, "b": None, "c": False}


def test_two_circles_cost_two_relations_unless_they_share_one() -> None:
    shared = [("a", "b"), ("b", "a2"), ("a2", "a"), ("b", "c"), ("c", "a")]
    facts = SceneFacts(
        tuple(SceneObject(name) for name in ("a", "a2", "b", "c")),
        tuple(relation(*pair) for pair in shared),
    )
    withdrawn = SESSION.classify(facts).retracted
    assert {(each.object, each.reference) for each in withdrawn} == {("a", "b")}


def test_a_contradiction_in_what_was_given_is_worded() -> None:
    rules = [ClassificationRule("neg(stable(A), n1) :- obj_size(A, small).", "n1")]
    rules += [ClassificationRule(":- obj_size(A, large), obj_size(B, small).", "never")]
    axioms = [Axiom("n1", "normal", "", Task.STABILITY)]
    session = ClassificationSession(Program(rules, axioms))
    objects = (
        SceneObject("a). bad(", size=Size.LARGE),
        SceneObject("b", size=Size.SMALL),
        SceneObject("c", size=Size.MEDIUM),
    )
    result = session.classify(SceneFacts(objects, ()))
    assert {each.stable.status for each in result.objects} == {DecisionStatus.INCONSISTENT}
    assert result.conflict == (
        "axiom never; the size of 'a). bad(' is large; the size of 'b' is small"
    )
    assert session.classify(SceneFacts(objects, ()), ["never"]).conflict == ""


ONE = SceneFacts((SceneObject("a", size=Size.SMALL), SceneObject("b")), ())


def classify(rules: str, facts: SceneFacts = ONE, time_limit_s: float = 60.0) -> Classification:
    """Classifies by rules in clingo's language; p1 is a normal axiom, p2 and n1 are defaults."""
    kinds: dict[str, Kind] = {"p1": "normal", "p2": "default", "n1": "default"}
    known = [Axiom(name, kind, "", Task.STABILITY) for name, kind in kinds.items()]
    program = Program([ClassificationRule(rules)], known)
    return ClassificationSession(program, time_limit_s).classify(facts)


OPPOSING = """
pos(stable(A), p1) :- obj_size(A, _), not neg(stable(A)).
neg(stable(A), n1) :- obj_size(A, _), not pos(stable(A)).
pos(occluded(A), p2) :- obj_size(A, _).
"""


def test_opposing_defaults_with_several_answer_sets_leave_it_undecided() -> None:
    result = classify(OPPOSING)
    assert result.objects[0].stable == Belief(status=DecisionStatus.UNDECIDED)
    assert result.objects[0].occluded.value is True


def test_what_holds_in_all_answer_sets_by_different_axioms_is_believed_by_default() -> None:
    result = classify(
        """{ choice }.
        pos(stable(A), p1) :- obj_size(A, _), choice.
        pos(stable(A), p2) :- obj_size(A, _), not choice.
        neg(occluded(A), n1) :- obj_size(A, _)."""
    )
    assert result.objects[0].stable == Belief(status=DecisionStatus.BY_DEFAULT, value=True)
    assert result.objects[0].occluded.axioms == ["n1"]


def test_a_contradiction_spoils_one_object_only() -> None:
    result = classify(
        """pos(stable(A), p1) :- A = 0..1.
        neg(stable(A), n1) :- obj_size(A, small).
        pos(occluded(A), p2) :- obj_size(A, _)."""
    )
    first, second = (each.stable for each in result.objects)
    assert first == Belief(status=DecisionStatus.INCONSISTENT, axioms=["p1", "n1"])
    assert second == Belief(status=DecisionStatus.STRICT, value=True, axioms=["p1"])


def test_without_any_answer_set_every_object_is_inconsistent() -> None:
    result = classify(OPPOSING + ":- obj_size(_, small).")
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
    classify(OPPOSING + "extra(X + 1) :- obj_size(_, X).")
    assert capfd.readouterr() == ("", "")
