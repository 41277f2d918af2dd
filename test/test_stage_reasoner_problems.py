"""What the reasoner does with scenes that are wrong, too large, too hard or contradictory."""

from __future__ import annotations

import msgspec
import pytest
from reasoner_samples import (
    TOWER,
    feed,
    objects,
    one,
    perceived,
    problems,
    relation,
    relations,
    scene,
    stage,
    status_of,
)

from ros_scenesense.errors import ReasoningError
from ros_scenesense.knowledge.classification import ClassificationRule
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.reasoning import Beliefs, RetractedRelation
from ros_scenesense.reasoning.program import Axiom, Program
from ros_scenesense.scene import (
    DecisionStatus,
    Distance,
    NamingFrame,
    Position,
    Size,
    Task,
)
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage


def test_wrong_relations_are_reported_once_for_each_kind_and_ignored() -> None:
    reasoner = stage()
    ghosts = [relation("cube", f"ghost {number}") for number in range(5)]
    loose = [relation("duck", "cube", Position.LEFT), relation("can", "can")]
    wrong = relations(*TOWER[2].relations, *ghosts, *loose)
    beliefs = one(feed(reasoner, TOWER[0], TOWER[1], wrong), Beliefs)
    found = problems(reasoner)
    assert set(found) == {
        "relation_of_unknown_object",
        "relation_contradictory",
        "relation_to_itself",
    }
    assert "s-1" in found["relation_of_unknown_object"]
    assert "'ghost 0'" in found["relation_of_unknown_object"]
    assert "(and 4 more of this kind)" in found["relation_of_unknown_object"]
    assert reasoner.health.counters["relation_of_unknown_object"] == 5
    # How cube and duck stand to each other is not known now, so nothing is concluded from what
    # they do not stand in; the can is as before.
    assert status_of(beliefs) == {
        "duck": (DecisionStatus.UNDECIDED, DecisionStatus.UNDECIDED),
        "cube": (DecisionStatus.UNDECIDED, DecisionStatus.UNDECIDED),
        "can": (DecisionStatus.STRICT, DecisionStatus.BY_DEFAULT),
    }


def test_objects_with_one_name_stay_undecided() -> None:
    reasoner = stage()
    twins = objects(perceived("duck"), perceived("cube"), perceived("cube"))
    beliefs = one(feed(reasoner, scene(), twins, relations(relation("cube", "duck"))), Beliefs)
    assert status_of(beliefs)["cube"] == (DecisionStatus.UNDECIDED, DecisionStatus.UNDECIDED)
    # The duck may stand on a cube, of which nobody knows where it is.
    assert status_of(beliefs)["duck"] == (DecisionStatus.UNDECIDED, DecisionStatus.STRICT)
    assert set(problems(reasoner)) == {"object_repeated", "relation_of_repeated_object"}


def test_an_object_that_is_not_located_or_not_reported_stays_undecided() -> None:
    reasoner = stage()
    reported = objects(perceived("cube"), perceived("hidden", located=False, size=Size.SMALL))
    outgoing = feed(reasoner, scene(["cube", "hidden", "lost"]), reported, relations())
    assert status_of(one(outgoing, Beliefs)) == {
        "cube": (DecisionStatus.UNDECIDED, DecisionStatus.STRICT),
        "hidden": (DecisionStatus.UNDECIDED, DecisionStatus.UNDECIDED),
        "lost": (DecisionStatus.UNDECIDED, DecisionStatus.UNDECIDED),
    }
    found = problems(reasoner)
    assert set(found) == {"object_not_reported"}
    assert "'lost'" in found["object_not_reported"]


def test_objects_on_each_other_in_a_circle() -> None:
    reasoner = stage()
    circle = relations(
        relation("duck", "cube", distance=Distance.TOUCHING),
        relation("cube", "can", distance=Distance.TOUCHING, confidence=0.3),
        relation("can", "duck", distance=Distance.TOUCHING),
    )
    beliefs = one(feed(reasoner, TOWER[0], TOWER[1], circle), Beliefs)
    assert decode(encode(beliefs), Beliefs) == beliefs
    # The least trusted relations of the circle, equally good to withdraw.
    assert beliefs.retracted == [
        RetractedRelation(
            relation=name, object="cube", reference="can", confidence=0.3, source="qsr"
        )
        for name in ("above", "touching")
    ]
    assert beliefs.conflict == ""
    supports = {(each.object, each.reference) for each in beliefs.derived}
    assert supports == {("duck", "cube"), ("can", "duck")}
    assert beliefs.objects[2].stable.value is False
    assert "'cube' is above 'can'" in problems(reasoner)["relations_retracted"]


def test_a_scene_that_is_too_large_is_settled_without_decisions() -> None:
    reasoner = stage(max_objects=2)
    outgoing = feed(reasoner, *TOWER)
    assert one(outgoing, Beliefs).objects == []
    assert "max_objects (2)" in problems(reasoner)["scene_too_large"]


def test_relations_in_the_robot_frame_say_nothing_of_occlusion() -> None:
    reasoner = stage()
    robot = relations(*TOWER[2].relations, frame=NamingFrame.ROBOT)
    outgoing = feed(reasoner, TOWER[0], TOWER[1], robot)
    statuses = status_of(one(outgoing, Beliefs))
    assert {occluded for _, occluded in statuses.values()} == {DecisionStatus.UNDECIDED}
    assert {stable for stable, _ in statuses.values()} == {DecisionStatus.STRICT}
    assert "viewer" in problems(reasoner)["relations_in_robot_frame"]


def test_directions_as_the_viewer_sees_them_say_what_hides_what() -> None:
    of_the_viewer = feed(stage(), *TOWER)
    turned = [
        msgspec.structs.replace(each, position=Position.RIGHT, viewer_position=each.position)
        if each.position is not Position.BELOW
        else each
        for each in TOWER[2].relations
    ]
    reasoner = stage()
    robot = relations(*turned, frame=NamingFrame.ROBOT)
    outgoing = feed(reasoner, TOWER[0], TOWER[1], robot)
    assert status_of(one(outgoing, Beliefs)) == status_of(one(of_the_viewer, Beliefs))
    assert not problems(reasoner)


SLOW = """
pos(stable(A), x) :- object(A).
{ in_hole(P, H) : H = 1..11 } = 1 :- P = 1..12.
:- in_hole(P, H), in_hole(Q, H), P < Q.
"""


def test_a_search_that_takes_too_long_is_reported() -> None:
    configuration = ReasonerConfiguration(time_limit_s=0.01)
    program = Program([ClassificationRule(SLOW)], [Axiom("x", "normal", "Slow.", Task.STABILITY)])
    reasoner = ReasonerStage(configuration, program)
    outgoing = feed(reasoner, *TOWER)
    assert set(status_of(one(outgoing, Beliefs)).values()) == {
        (DecisionStatus.TIMED_OUT, DecisionStatus.TIMED_OUT)
    }
    assert "0.01 s" in problems(reasoner)["classification_timed_out"]


def test_a_solver_that_fails_leaves_the_scene_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("std::bad_alloc")

    reasoner = stage()
    monkeypatch.setattr("ros_scenesense.reasoning.classification.solve", fail)
    outgoing = feed(reasoner, *TOWER)
    assert set(status_of(one(outgoing, Beliefs)).values()) == {
        (DecisionStatus.UNDECIDED, DecisionStatus.UNDECIDED)
    }
    assert "std::bad_alloc" in problems(reasoner)["classification_failed"]


def test_a_broken_program_stops_the_stage_at_once() -> None:
    with pytest.raises(ReasoningError, match=r"domain:1:4-5: error"):
        ReasonerStage(ReasonerConfiguration(), Program([ClassificationRule("a(A.")], [], "domain"))


def test_a_scene_that_nothing_makes_consistent_is_reported_with_the_reason() -> None:
    rules = [ClassificationRule(":- obj_surface(A, irregular).", "flat_world")]
    reasoner = ReasonerStage(ReasonerConfiguration(), Program(rules, []))
    beliefs = one(feed(reasoner, *TOWER), Beliefs)
    assert beliefs.conflict == "axiom flat_world; the surface of 'duck' is irregular"
    assert {each.stable.status for each in beliefs.objects} == {DecisionStatus.INCONSISTENT}
    assert beliefs.conflict in problems(reasoner)["scene_inconsistent"]
