"""Who decides: reasoning, a default, the network, or nobody."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.attention.estimator import Estimator, measured_purity
from ros_scenesense.messages.attention import Estimate
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.reasoning import Belief, Beliefs, ObjectBelief, StructureBelief
from ros_scenesense.scene import DecisionStatus, Task

UNDECIDED = Belief(status=DecisionStatus.UNDECIDED)
STRICTLY = Belief(status=DecisionStatus.STRICT, value=True, axioms=["s1"])
BY_DEFAULT = Belief(status=DecisionStatus.BY_DEFAULT, value=False, axioms=["s3"])
OVERRULE = Estimator(defaults="overrule", purity={"s3": 0.8})


def test_reasoning_decides_whatever_the_network_says():
    assert OVERRULE.decide(STRICTLY, 0.01) == Estimate(value=True, source="reasoning")


@pytest.mark.parametrize(("said", "value", "sure"), [(0.9, True, 0.9), (0.2, False, 0.8)])
def test_the_network_decides_where_reasoning_does_not(said, value, sure):
    found = Estimator().decide(UNDECIDED, said)
    assert found == Estimate(value=value, source="network", probability=pytest.approx(sure))


@pytest.mark.parametrize("status", ["inconsistent", "timed_out"])
def test_the_network_decides_where_reasoning_failed(status):
    belief = Belief(status=DecisionStatus(status), axioms=["s1", "s2"])
    assert Estimator().decide(belief, 0.9).source == "network"
    assert Estimator().decide(belief, None) == Estimate(value=None, source="none")


@pytest.mark.parametrize(
    ("status", "answers", "source"),
    [
        ("timed_out", {}, "timeout"),
        ("timed_out", {("a", Task.STABILITY): 0.9}, "network"),
        ("undecided", {}, "none"),
        ("undecided", {("a", Task.STABILITY): None}, "timeout"),
        ("undecided", {("a", Task.STABILITY): 0.0}, "network"),
        ("strict", {("a", Task.STABILITY): None}, "reasoning"),
    ],
)
def test_undecided_because_of_the_time_is_said(status, answers, source):
    value = True if status == "strict" else None
    stable = Belief(status=DecisionStatus(status), value=value)
    beliefs = Beliefs(
        stamp=Stamp.of(0),
        scene_id="s-0",
        objects=[ObjectBelief(name="a", stable=stable, occluded=UNDECIDED)],
        structures=[StructureBelief(members=["a"], stable=stable)],
        derived=[],
        knowledge_revision="k",
        trust_revision=0,
    )
    objects = Estimator().objects(beliefs, answers)
    (structure,) = Estimator().structures(beliefs, objects)
    assert objects[0].stable.source == structure.stable.source == source
    assert objects[0].occluded.source == "none"


def test_it_abstains_below_the_confidence_that_is_asked_for():
    assert Estimator(confidence=0.9).decide(UNDECIDED, 0.85).value is None
    assert Estimator(confidence=0.9).decide(UNDECIDED, 0.05).value is False


def test_a_default_stands_unless_it_may_be_overruled_by_somebody_surer():
    assert Estimator(purity={"s3": 0.8}).decide(BY_DEFAULT, 0.99) == Estimate(
        value=False, source="default", probability=0.8
    )
    assert OVERRULE.decide(BY_DEFAULT, 0.75).source == "default"
    assert OVERRULE.decide(BY_DEFAULT, 0.1).source == "default"
    assert OVERRULE.decide(BY_DEFAULT, 0.85) == Estimate(
        value=True, source="network", probability=0.85
    )


def test_a_default_that_was_never_measured_is_not_overruled():
    found = Estimator(defaults="overrule").decide(BY_DEFAULT, 1.0)
    assert found == Estimate(value=False, source="default", probability=None)


def test_purity_is_cautious_where_little_was_seen():
    assert measured_purity({"a": (0, 0), "b": (8, 0), "c": (89, 9)}) == {
        "a": 0.5,
        "b": 0.9,
        "c": 0.9,
    }


def beliefs_of(stable):
    names = [f"o{number}" for number in range(len(stable))]
    return Beliefs(
        stamp=Stamp.of(0),
        scene_id="s-0",
        objects=[
            ObjectBelief(name=name, stable=each, occluded=UNDECIDED)
            for name, each in zip(names, stable, strict=True)
        ],
        structures=[StructureBelief(members=names, stable=UNDECIDED)],
        derived=[],
        knowledge_revision="k",
        trust_revision=0,
    )


def structure(stable, answers=None, estimator=OVERRULE):
    beliefs = beliefs_of(stable)
    objects = estimator.objects(
        beliefs, {(name, Task.STABILITY): value for name, value in (answers or {}).items()}
    )
    (found,) = estimator.structures(beliefs, objects)
    return found.stable


def test_a_structure_is_as_sure_as_its_weakest_member():
    assert structure([STRICTLY, STRICTLY]) == Estimate(value=True, source="reasoning")
    assert structure([STRICTLY, UNDECIDED]).value is None
    found = structure([STRICTLY, UNDECIDED, UNDECIDED], {"o1": 0.9, "o2": 0.7})
    assert found == Estimate(value=True, source="network", probability=0.7)


def test_one_unstable_member_is_enough():
    assert structure([UNDECIDED, BY_DEFAULT]) == Estimate(
        value=False, source="default", probability=0.8
    )
    found = structure([UNDECIDED, UNDECIDED, STRICTLY], {"o0": 0.4, "o1": 0.1})
    assert found == Estimate(value=False, source="network", probability=pytest.approx(0.9))


@given(st.lists(st.sampled_from([UNDECIDED, STRICTLY, BY_DEFAULT]), max_size=5), st.floats(0, 1))
def test_structures_agree_with_their_members(stable, answer):
    beliefs = beliefs_of(stable)
    objects = OVERRULE.objects(beliefs, {("o0", Task.STABILITY): answer})
    (found,) = OVERRULE.structures(beliefs, objects)
    values = [each.stable.value for each in objects]
    expected = False if False in values else True if values and None not in values else None
    assert found.stable.value is expected
    assert all(each.occluded == Estimate(value=None, source="none") for each in objects)
