"""What control settles on: one relation per pair, in one documented direction."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.grounding.control import SWITCH, Control
from ros_scenesense.grounding.trust import TrustSettings
from ros_scenesense.messages.grounding import Grounding, PairGrounding
from ros_scenesense.scene import Distance, Position

CONTROL = Control(SWITCH)


def says(
    position: Position,
    confidence: float = 0.9,
    distance: Distance = Distance.NOT_TOUCHING,
    distance_confidence: float = 0.8,
) -> Grounding:
    return Grounding(
        position=position,
        position_confidence=confidence,
        distance=distance,
        distance_confidence=distance_confidence,
    )


def pair(first: str, second: str, grounding: Grounding) -> PairGrounding:
    return PairGrounding(object=first, reference=second, qsr=grounding)


def settled_pair(forward: Grounding | None, backward: Grounding | None):
    """The relation of a and b from what is said of (a, b) and (b, a), and the disagreements."""
    pairs = []
    if backward is not None:
        pairs.append(pair("b", "a", backward))
    if forward is not None:
        pairs.append(pair("a", "b", forward))
    settled = CONTROL.settle(pairs)
    (relation,) = settled.relations
    return (relation.object, relation.position, relation.reference), settled.disagreements, relation


@pytest.mark.parametrize("position", [one for one in Position if one.converse])
def test_directions_that_agree_give_one_relation_in_the_order_of_the_names(position):
    words, disagreements, relation = settled_pair(says(position), says(position.converse, 0.95))
    assert words == ("a", position, "b")
    assert disagreements == 0
    assert (relation.position_confidence, relation.position_source) == (0.95, "qsr")


@pytest.mark.parametrize(
    ("forward", "backward", "expected"),
    [
        (says(Position.ABOVE, 0.9), says(Position.FRONT, 0.6), Position.ABOVE),
        (says(Position.ABOVE, 0.6), says(Position.FRONT, 0.9), Position.BEHIND),
        (says(Position.ABOVE, 0.7), says(Position.FRONT, 0.7), Position.ABOVE),
    ],
    ids=["forward", "backward", "tie"],
)
def test_where_they_disagree_the_more_confident_wins_and_it_is_counted(forward, backward, expected):
    words, disagreements, _ = settled_pair(forward, backward)
    assert words == ("a", expected, "b")
    assert disagreements == 1


def test_the_contained_object_comes_first_whatever_its_name():
    words, disagreements, _ = settled_pair(says(Position.ABOVE, 0.99), says(Position.IN, 0.6))
    assert words == ("b", Position.IN, "a")
    assert disagreements == 0


def test_two_objects_cannot_be_in_each_other():
    words, disagreements, _ = settled_pair(says(Position.IN, 0.6), says(Position.IN, 0.8))
    assert words == ("b", Position.IN, "a")
    assert disagreements == 1


def test_the_more_confident_distance_wins_apart_from_the_position():
    _, disagreements, relation = settled_pair(
        says(Position.ABOVE, 0.9, Distance.TOUCHING, 0.6),
        says(Position.BELOW, 0.5, Distance.NOT_TOUCHING, 0.7),
    )
    assert (relation.position_confidence, relation.distance) == (0.9, Distance.NOT_TOUCHING)
    assert relation.distance_confidence == 0.7
    assert disagreements == 1


def test_one_direction_is_enough():
    assert settled_pair(says(Position.LEFT), None)[0] == ("a", Position.LEFT, "b")
    assert settled_pair(None, says(Position.LEFT))[0] == ("a", Position.RIGHT, "b")


def test_the_more_trusted_model_speaks_and_the_other_where_it_is_silent():
    left, right = says(Position.LEFT), says(Position.RIGHT)
    pairs = [
        PairGrounding(object="a", reference="b", qsr=left, msr=right),
        PairGrounding(object="a", reference="c", msr=right),
        PairGrounding(object="a", reference="d"),
    ]
    by_qsr = CONTROL.settle(pairs).relations
    assert [(one.position, one.position_source) for one in by_qsr] == [
        (Position.LEFT, "qsr"),
        (Position.RIGHT, "msr"),
    ]
    by_msr = Control(SWITCH, TrustSettings(qsr=0.3, msr=0.6)).settle(pairs)
    assert by_msr.relations[0].position_source == "msr"


GROUNDINGS = st.builds(
    Grounding,
    position=st.sampled_from(Position),
    position_confidence=st.floats(0.0, 1.0),
    distance=st.sampled_from(Distance),
    distance_confidence=st.floats(0.0, 1.0),
)
NAMES = st.sampled_from(["a", "b", "c", "d"])
PAIRS = st.dictionaries(
    st.tuples(NAMES, NAMES).filter(lambda names: names[0] != names[1]), GROUNDINGS
)


@given(PAIRS, st.randoms())
def test_each_unordered_pair_gets_one_relation_whatever_the_order_of_the_message(said, random):
    pairs = [pair(*names, grounding) for names, grounding in said.items()]
    settled = CONTROL.settle(pairs)
    assert {frozenset(names) for names in said} == {
        frozenset((one.object, one.reference)) for one in settled.relations
    }
    assert len(settled.relations) == len({frozenset(names) for names in said})
    for one in settled.relations:
        assert one.position is Position.IN or one.object < one.reference
    random.shuffle(pairs)
    assert CONTROL.settle(pairs) == settled
