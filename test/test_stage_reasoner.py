from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TypeVar

import msgspec
import pytest

from ros_scenesense.errors import ParameterError, ReasoningError
from ros_scenesense.geometry import Box, Pose
from ros_scenesense.knowledge.classification import ClassificationRule
from ros_scenesense.messages.base import AnyMessage, Stamp
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.grounding import (
    Objects,
    PerceivedObject,
    Relation,
    Relations,
    SizeAttribute,
    SurfaceAttribute,
)
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, RetractedRelation, Verdicts
from ros_scenesense.messages.scenes import (
    KnownObject,
    Labels,
    ObjectLabel,
    Scene,
    StructureLabel,
)
from ros_scenesense.parameters import build
from ros_scenesense.reasoning.program import Axiom, Program
from ros_scenesense.scene import (
    DecisionStatus,
    Distance,
    NamingFrame,
    Position,
    Size,
    Surface,
    Task,
    Truth,
)
from ros_scenesense.stages.planning_engine import PlanningEngine
from ros_scenesense.stages.protocol import Outgoing, Stage, Timing
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage

T = TypeVar("T")

STAMP = Stamp.of(12_000_000_034)
BOX = Box(pose=Pose((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)), size=(0.1, 0.1, 0.1))
SECOND = 1_000_000_000


def stage(**values: object) -> ReasonerStage:
    return ReasonerStage(build(ReasonerConfiguration, values))


def scene(names: Sequence[str] = (), number: int = 1, **extra: object) -> Scene:
    known = [KnownObject(instance=i + 1, name=name) for i, name in enumerate(names)]
    return Scene(
        stamp=STAMP,
        scene_id=f"s-{number}",
        mode="testing",
        objects=known,
        **extra,  # type: ignore
    )


def perceived(
    name: str,
    located: bool = True,
    size: Size | None = None,
    surface: Surface | None = None,
) -> PerceivedObject:
    return PerceivedObject(
        instance=1,
        name=name,
        points=500 if located else 0,
        box=BOX if located else None,
        size=SizeAttribute(value=size, source="given") if size else None,
        surface=SurfaceAttribute(value=surface, source="measured") if surface else None,
    )


def objects(*each: PerceivedObject, number: int = 1) -> Objects:
    return Objects(stamp=STAMP, scene_id=f"s-{number}", frame_id="camera", objects=list(each))


def relation(
    one: str,
    other: str,
    position: Position = Position.ABOVE,
    distance: Distance = Distance.FAR,
    confidence: float = 0.9,
) -> Relation:
    return Relation(
        object=one,
        reference=other,
        position=position,
        position_confidence=confidence,
        position_source="qsr",
        distance=distance,
        distance_confidence=confidence,
        distance_source="qsr",
    )


def relations(
    *each: Relation, number: int = 1, frame: NamingFrame = NamingFrame.VIEWER
) -> Relations:
    return Relations(
        stamp=STAMP,
        scene_id=f"s-{number}",
        naming_frame=frame,
        relations=list(each),
        disagreements=0,
        trust_qsr=0.8,
        trust_msr=0.2,
        trust_revision=7,
    )


def labels(
    stable: dict[str, Truth],
    structures: dict[tuple[str, ...], Truth] | None = None,
    number: int = 1,
) -> Labels:
    return Labels(
        stamp=STAMP,
        scene_id=f"s-{number}",
        use="train",
        objects=[
            ObjectLabel(name=name, stable=truth, occluded=Truth.FALSE)
            for name, truth in stable.items()
        ],
        structures=[
            StructureLabel(members=list(members), stable=truth)
            for members, truth in (structures or {}).items()
        ],
    )


# A cube on a duck, and a can behind the duck.
TOWER = (
    scene(["duck", "cube", "can"]),
    objects(perceived("duck", surface=Surface.IRREGULAR), perceived("cube"), perceived("can")),
    relations(
        relation("duck", "cube", Position.BELOW, Distance.TOUCHING),
        relation("can", "duck", Position.BEHIND),
        relation("can", "cube", Position.LEFT),
    ),
)


def feed(reasoner: ReasonerStage, *items: AnyMessage) -> list[Outgoing]:
    outgoing = [message for item in items for message in reasoner.handle(item, 0)]
    for message in outgoing:
        if isinstance(message, AnyMessage):
            assert decode(encode(message), type(message)) == message
    return outgoing


def one(outgoing: Sequence[Outgoing], kind: type[T]) -> T:
    [found] = [message for message in outgoing if isinstance(message, kind)]
    return found


def status_of(beliefs: Beliefs) -> dict[str, tuple[DecisionStatus, DecisionStatus]]:
    return {each.name: (each.stable.status, each.occluded.status) for each in beliefs.objects}


def test_it_is_a_stage_whose_only_slow_work_is_planning() -> None:
    reasoner: Stage = stage()
    assert reasoner.engine() is PlanningEngine
    assert reasoner.jobs() == []
    reasoner.close()


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_a_scene_is_decided_once_all_its_parts_have_come(order: tuple[int, ...]) -> None:
    reasoner = stage()
    first, second, third = (TOWER[index] for index in order)
    assert feed(reasoner, first, second) == []
    outgoing = feed(reasoner, third)

    beliefs = one(outgoing, Beliefs)
    assert (beliefs.stamp, beliefs.scene_id, beliefs.trust_revision) == (STAMP, "s-1", 7)
    cube = next(each for each in beliefs.objects if each.name == "cube")
    assert (cube.stable.status, cube.stable.value, cube.stable.axioms) == (
        DecisionStatus.STRICT,
        False,
        ["s2"],
    )
    assert [(each.members, each.stable.value) for each in beliefs.structures] == [
        (["can"], True),
        (["cube", "duck"], False),
    ]
    assert [(each.relation, each.object, each.reference) for each in beliefs.derived] == [
        ("on", "cube", "duck")
    ]
    timing = one(outgoing, Timing)
    assert timing.name == "reasoner/classify"
    assert timing.milliseconds > 0
    assert list(reasoner.health.take_problems()) == []


@pytest.mark.parametrize("labels_first", [True, False])
def test_beliefs_are_held_against_labels_in_either_order(labels_first: bool) -> None:
    reasoner = stage()
    truth = labels(
        {"duck": Truth.TRUE, "cube": Truth.TRUE, "can": Truth.AMBIGUOUS},
        {("duck", "cube"): Truth.FALSE, ("can", "box"): Truth.TRUE},
    )
    items = [truth, *TOWER] if labels_first else [*TOWER, truth]
    verdicts = one(feed(reasoner, *items), Verdicts)
    assert (verdicts.stamp, verdicts.scene_id, verdicts.use) == (STAMP, "s-1", "train")
    found = {
        (each.task.value, each.kind, *each.subject): each.verdict for each in verdicts.verdicts
    }
    assert found == {
        ("stability", "object", "duck"): "right",
        ("stability", "object", "cube"): "wrong",
        ("stability", "object", "can"): "unjudged",
        ("occlusion", "object", "duck"): "right",
        ("occlusion", "object", "cube"): "right",
        ("occlusion", "object", "can"): "wrong",
        ("stability", "structure", "cube", "duck"): "right",
        ("stability", "structure", "can"): "unjudged",
    }


def test_the_axioms_in_force_are_published_at_the_start() -> None:
    [knowledge] = stage(withheld="s1, o3").start(5 * SECOND)
    assert isinstance(knowledge, Knowledge)
    assert decode(encode(knowledge), Knowledge) == knowledge
    assert knowledge.stamp == Stamp.of(5 * SECOND)
    ids = ["large_on_small", "tall_tower", "s2", "s3", "o1", "o2"]
    assert [each.id for each in knowledge.axioms] == ids
    assert {each.origin for each in knowledge.axioms} == {"given"}
    assert all(each.text.endswith(".") for each in knowledge.axioms)
    beliefs = one(feed(stage(withheld="s1,o3"), *TOWER), Beliefs)
    assert beliefs.knowledge_revision == knowledge.revision
    assert one(feed(stage(), *TOWER), Beliefs).knowledge_revision != knowledge.revision


@pytest.mark.parametrize("withheld", ["s9", "s1,s9", "s1 s2", "S1"])
def test_an_unknown_axiom_cannot_be_withheld(withheld: str) -> None:
    with pytest.raises(ParameterError) as caught:
        stage(withheld=withheld)
    assert "parameter 'withheld'" in str(caught.value)
    assert withheld in str(caught.value)
    assert "large_on_small, tall_tower, s1, s2, s3, o1, o2, o3" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"), [("time_limit_s", 0), ("max_objects", 101), ("join_timeout_s", 0)]
)
def test_parameters_have_ranges(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=name):
        stage(**{name: value})


def test_a_scene_without_objects_is_settled_too() -> None:
    outgoing = feed(stage(), scene(), objects(), relations(), labels({}))
    assert one(outgoing, Beliefs).objects == []
    assert one(outgoing, Verdicts).verdicts == []


def test_repeats_are_counted_and_ignored() -> None:
    reasoner = stage()
    truth = labels({"duck": Truth.FALSE})
    feed(reasoner, TOWER[0], TOWER[0], truth, truth)
    assert len(feed(reasoner, *TOWER)) == 3
    assert feed(reasoner, *TOWER, truth, relations()) == []
    counters = reasoner.health.counters
    assert counters["scene_repeated"] == 3
    assert counters["objects_repeated"] == 1
    assert counters["relations_repeated"] == 2
    assert counters["labels_repeated"] == 2
    assert counters["scenes_classified"] == 1
    assert list(reasoner.health.take_problems()) == []


def test_a_scene_that_stays_incomplete_is_given_up_and_may_come_again() -> None:
    reasoner = stage(join_timeout_s=2.0)
    feed(reasoner, TOWER[0], labels({}))
    assert reasoner.tick(1 * SECOND) == []
    assert list(reasoner.health.take_problems()) == []
    reasoner.tick(3 * SECOND)
    [(kind, words)] = reasoner.health.take_problems()
    assert kind == "scene_incomplete"
    assert "s-1" in words
    assert "relations (from grounding_control) and objects (from grounding)" in words
    assert one(feed(reasoner, *TOWER), Verdicts).verdicts


def test_scenes_without_labels_and_labels_without_scenes_do_not_pile_up() -> None:
    reasoner = stage(join_timeout_s=2.0)
    feed(reasoner, *TOWER, labels({}, number=2))
    reasoner.tick(5 * SECOND)
    assert list(reasoner.health.take_problems()) == []
    assert reasoner.health.counters["verdicts_without_labels"] == 1
    assert reasoner.health.counters["verdicts_without_beliefs"] == 1


def problems(reasoner: ReasonerStage) -> dict[str, str]:
    return dict(reasoner.health.take_problems())


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
