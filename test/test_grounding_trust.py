"""Whom control believes: trust by agreement with people, duels, drops of agreement."""

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.grounding.control import ARBITER, SWITCH, Control
from ros_scenesense.grounding.trust import Agreement, Kind, Model, TrustSettings, TrustState
from ros_scenesense.messages.grounding import Grounding, PairGrounding
from ros_scenesense.scene import Distance, Position

AROUND = [Position.RIGHT, Position.BEHIND, Position.LEFT, Position.FRONT]


def said(position: Position, distance=Distance.NOT_TOUCHING, confidence=0.8) -> Grounding:
    return Grounding(
        position=position,
        position_confidence=confidence,
        distance=distance,
        distance_confidence=confidence,
    )


def pair(qsr: Grounding | None, msr: Grounding | None) -> PairGrounding:
    return PairGrounding(object="a", reference="b", qsr=qsr, msr=msr)


def other(position, rng):
    choice = [one for one in AROUND if one is not position]
    return choice[int(rng.integers(len(choice)))]


def stream(control, right, words, rng, wrong=0.0):
    """Words of people about pairs that the models name rightly in these shares of cases."""
    dropped = 0
    for _ in range(words):
        true = AROUND[int(rng.integers(4))]
        names = {
            model: true if rng.random() < share else other(true, rng)
            for model, share in right.items()
        }
        word = true if rng.random() >= wrong else other(true, rng)
        forward = pair(*(said(names[model]) for model in Model))
        dropped += control.learn(word, forward, None).dropped
    return dropped


def chosen(control) -> str:
    """Whose word is passed on where the two contradict each other."""
    (relation,) = control.settle([pair(said(Position.LEFT), said(Position.FRONT))]).relations
    return relation.position_source


def test_trust_starts_high_for_qsr_and_low_for_msr():
    control = Control()
    assert (control.trust(Model.QSR), control.trust(Model.MSR)) == (0.9, 0.1)
    for kind in Kind:
        assert control.trust(Model.QSR, kind) == 0.9
    assert chosen(control) == chosen(Control(SWITCH)) == "qsr"


def test_trust_is_the_share_of_agreement_from_its_prior():
    control = Control(settings=TrustSettings(weight=2.0))
    forward = pair(said(Position.LEFT), said(Position.ABOVE))
    learned = control.learn(Position.LEFT, forward, None)
    assert learned.agreed == {Model.QSR: True, Model.MSR: False}
    assert control.trust(Model.QSR, Kind.HORIZONTAL) == pytest.approx((0.9 * 2 + 1) / 3)
    assert control.trust(Model.MSR, Kind.HORIZONTAL) == pytest.approx(0.1 * 2 / 3)
    assert control.trust(Model.QSR, Kind.VERTICAL) == 0.9
    assert control.trust(Model.QSR) == pytest.approx((0.9 * 2 + 1) / 3)
    control.learn(Distance.FAR, forward, None)
    assert control.trust(Model.QSR, Kind.DISTANCE) == pytest.approx(0.9 * 2 / 3)
    assert control.state.feedback_count == 2


def test_the_other_direction_of_a_pair_counts_too():
    backward = PairGrounding(object="b", reference="a", qsr=said(Position.RIGHT))
    assert Control().learn(Position.LEFT, None, backward).agreed == {Model.QSR: True}
    contained = PairGrounding(object="b", reference="a", qsr=said(Position.IN))
    assert Control().learn(Position.IN, None, contained).agreed == {Model.QSR: False}


def test_feedback_on_a_pair_that_nobody_named_changes_no_trust():
    control = Control()
    assert control.learn(Position.LEFT, None, None).agreed == {}
    assert control.trust(Model.QSR) == 0.9
    assert control.state.feedback_count == 1


@pytest.mark.parametrize("mode", [SWITCH, ARBITER])
@pytest.mark.parametrize("wrong", [0.0, 0.2, 0.4])
@pytest.mark.parametrize(("qsr", "msr", "better"), [(0.95, 0.5, "qsr"), (0.4, 0.95, "msr")])
def test_the_better_one_is_believed_although_people_err(mode, wrong, qsr, msr, better):
    believed = []
    for seed in range(10):
        control = Control(mode)
        right = {Model.QSR: qsr, Model.MSR: msr}
        stream(control, right, 120, np.random.default_rng(seed), wrong)
        believed.append(chosen(control))
    assert believed.count(better) >= 9


@settings(max_examples=15)
@given(st.integers(0, 10_000), st.floats(0.0, 0.4), st.booleans())
def test_never_far_below_the_better_of_two(seed, wrong, qsr_is_better):
    rng = np.random.default_rng(seed)
    shares = sorted(rng.uniform(0.3, 1.0, 2))
    worse, better = shares[0] * 0.6, shares[1]
    right = {Model.QSR: better, Model.MSR: worse}
    if not qsr_is_better:
        right = {Model.QSR: worse, Model.MSR: better}
    control = Control()
    stream(control, right, 300, rng, wrong)
    hits, count = 0, 400
    for _ in range(count):
        true = AROUND[int(rng.integers(4))]
        names = [said(true if rng.random() < right[model] else other(true, rng)) for model in Model]
        (relation,) = control.settle([pair(*names)]).relations
        hits += relation.position is true
    # Half a percent, and three standard errors of counting so many.
    assert hits / count >= better - 0.005 - 3.0 * np.sqrt(better * (1.0 - better) / count) - 0.01


def test_the_arbiter_believes_each_where_it_is_right():
    control = Control(ARBITER)
    for _ in range(20):
        control.learn(Position.LEFT, pair(said(Position.LEFT), said(Position.FRONT)), None)
        control.learn(Position.ABOVE, pair(said(Position.BELOW), said(Position.ABOVE)), None)
    pairs = [
        pair(said(Position.LEFT), said(Position.FRONT)),
        PairGrounding(
            object="c", reference="d", qsr=said(Position.BELOW), msr=said(Position.ABOVE)
        ),
    ]
    sources = [one.position_source for one in control.settle(pairs).relations]
    assert sources == ["qsr", "msr"]


def test_position_and_distance_may_come_from_different_models():
    control = Control(ARBITER)
    forward = pair(
        said(Position.LEFT, Distance.FAR), said(Position.LEFT, Distance.TOUCHING, confidence=0.9)
    )
    for _ in range(10):
        control.learn(Distance.TOUCHING, forward, None)
    (relation,) = control.settle([forward]).relations
    assert (relation.position_source, relation.distance_source) == ("qsr", "msr")
    assert relation.distance is Distance.TOUCHING


def test_of_two_equally_trusted_the_surer_is_believed():
    control = Control(ARBITER, TrustSettings(qsr=0.5, msr=0.5))
    words = [said(Position.LEFT, confidence=0.6), said(Position.FRONT, confidence=0.9)]
    (relation,) = control.settle([pair(*words)]).relations
    assert relation.position_source == "msr"
    (relation,) = control.settle([pair(words[1], words[0])]).relations
    assert relation.position_source == "qsr"


def test_a_drop_of_agreement_is_noticed_once_and_old_trust_fades():
    control = Control()
    rng = np.random.default_rng(4)
    assert stream(control, {Model.QSR: 0.97, Model.MSR: 0.9}, 40, rng) == 0
    drops = stream(control, {Model.QSR: 0.3, Model.MSR: 0.3}, 14, rng)
    assert drops >= 1
    assert control.state.viewpoint == drops
    assert control.state.qsr[Kind.HORIZONTAL].given <= 14


def test_steady_errors_of_people_are_no_drop():
    drops = [
        stream(Control(), {Model.QSR: 0.97, Model.MSR: 0.9}, 40, np.random.default_rng(seed), 0.1)
        for seed in range(40)
    ]
    assert np.mean(np.array(drops) > 0) < 0.25


def test_the_state_can_be_written_and_read():
    control = Control()
    stream(control, {Model.QSR: 0.7, Model.MSR: 0.6}, 50, np.random.default_rng(1), 0.2)
    state = msgspec.json.decode(msgspec.json.encode(control.state), type=TrustState)
    again = Control(state=state)
    assert again.state == control.state
    assert chosen(again) == chosen(control)
    assert again.trust(Model.MSR) == control.trust(Model.MSR)


def test_fading_keeps_the_share():
    assert Agreement(6.0, 8.0).faded(2.0) == Agreement(1.5, 2.0)
    assert Agreement(1.0, 1.0).faded(2.0) == Agreement(1.0, 1.0)


GROUNDINGS = st.none() | st.builds(
    Grounding,
    position=st.sampled_from(Position),
    position_confidence=st.floats(0.0, 1.0),
    distance=st.sampled_from(Distance),
    distance_confidence=st.floats(0.0, 1.0),
)


@given(st.sampled_from([SWITCH, ARBITER]), *[GROUNDINGS] * 4)
def test_what_is_settled_was_said_by_its_source_in_one_direction_or_the_other(
    mode, qsr, msr, backward_qsr, backward_msr
):
    there = pair(qsr, msr)
    back = PairGrounding(object="b", reference="a", qsr=backward_qsr, msr=backward_msr)
    relations = Control(mode).settle([there, back]).relations
    assert len(relations) == any(one is not None for one in (qsr, msr, backward_qsr, backward_msr))
    for one in relations:
        forward, backward = (there, back) if one.object == "a" else (back, there)
        words = [getattr(forward, one.position_source), getattr(backward, one.position_source)]
        positions = {words[0] and words[0].position, words[1] and words[1].position.converse}
        assert one.position in positions
        near = [getattr(each, one.distance_source) for each in (there, back)]
        assert one.distance in {word.distance for word in near if word is not None}
