"""The reasoner stage: a scene is decided once its parts have come, and held against labels."""

from __future__ import annotations

import itertools

import pytest
from reasoner_samples import (
    SECOND,
    STAMP,
    TOWER,
    feed,
    labels,
    objects,
    one,
    relations,
    scene,
    stage,
)

from ros_scenesense.errors import ParameterError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, Verdicts
from ros_scenesense.scene import (
    DecisionStatus,
    Truth,
)
from ros_scenesense.stages.planning_engine import PlanningEngine
from ros_scenesense.stages.protocol import Stage, Timing


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
