"""What people's words tell of their axes, and what grounding remembers of it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.grounding.histograms import DISTANCE_BINS, POSITION_BINS, PairHistograms
from ros_scenesense.grounding.memory import Example, GroundingMemory
from ros_scenesense.grounding.msr import Source
from ros_scenesense.grounding.viewpoint import ViewpointEstimator
from ros_scenesense.scene import Distance, Position

AROUND = [Position.RIGHT, Position.BEHIND, Position.LEFT, Position.FRONT]


def word(azimuth_rad: float, yaw_rad: float) -> Position:
    """What somebody says whose axes are turned by an angle."""
    return AROUND[round((azimuth_rad - yaw_rad) / (math.pi / 2.0)) % 4]


def told(yaw_deg: float, count: int, seed: int, wrong: float = 0.0) -> ViewpointEstimator:
    rng = np.random.default_rng(seed)
    estimator = ViewpointEstimator()
    tell(estimator, yaw_deg, count, rng, wrong)
    return estimator


def tell(estimator, yaw_deg, count, rng, wrong=0.0):
    for _ in range(count):
        azimuth = rng.uniform(-math.pi, math.pi)
        said = word(azimuth, math.radians(yaw_deg))
        if rng.random() < wrong:
            said = AROUND[(AROUND.index(said) + int(rng.integers(1, 4))) % 4]
        estimator.observe(said, azimuth)


def off_deg(estimator, yaw_deg):
    return abs(math.degrees(math.remainder(estimator.yaw_rad - math.radians(yaw_deg), math.tau)))


def test_without_words_the_viewers_axes_are_peoples():
    assert ViewpointEstimator().yaw_rad == 0.0


@given(st.integers(0, 1000), st.integers(1, 60))
def test_words_that_fit_change_nothing(seed, count):
    assert told(0.0, count, seed).yaw_rad == 0.0


@settings(max_examples=30)
@given(st.sampled_from([-90.0, -50.0, 60.0, 120.0, 180.0]), st.integers(0, 1000))
def test_thirty_words_tell_the_angle(yaw_deg, seed):
    assert off_deg(told(yaw_deg, 30, seed), yaw_deg) < 15.0


def test_few_wrong_words_do_not_turn_the_axes():
    turned = [told(0.0, 30, seed, wrong=0.1).yaw_rad != 0.0 for seed in range(60)]
    assert np.mean(turned) < 0.1


def test_who_knows_that_the_camera_moved_needs_fewer_words():
    off = {True: [], False: []}
    for seed in range(60):
        for known in off:
            rng = np.random.default_rng(seed)
            estimator = ViewpointEstimator()
            tell(estimator, 0.0, 7, rng)
            if known:
                estimator.expect_change()
            tell(estimator, 40.0, 4, rng)
            off[known].append(off_deg(estimator, 40.0))
    assert np.mean(off[True]) < np.mean(off[False]) - 5.0


def test_a_camera_that_moved_but_is_where_it_was_turns_nothing():
    estimator = ViewpointEstimator()
    rng = np.random.default_rng(2)
    tell(estimator, 0.0, 10, rng)
    estimator.expect_change()
    tell(estimator, 0.0, 20, rng)
    assert off_deg(estimator, 0.0) < 10.0


def test_the_angle_is_found_among_wrong_words():
    off = [off_deg(told(60.0, 40, seed, wrong=0.2), 60.0) for seed in range(40)]
    assert np.mean(np.array(off) < 20.0) > 0.85


def test_a_second_change_is_noticed_too():
    rng = np.random.default_rng(3)
    estimator = ViewpointEstimator()
    for yaw_deg in (0.0, 90.0, 0.0):
        tell(estimator, yaw_deg, 30, rng)
        assert off_deg(estimator, yaw_deg) < 15.0


def test_words_about_above_and_in_say_nothing():
    estimator = ViewpointEstimator()
    for _ in range(20):
        for position in (Position.ABOVE, Position.BELOW, Position.IN):
            assert not estimator.observe(position, 1.0)
    assert estimator.yaw_rad == 0.0


def test_arrays_keep_the_estimate_and_the_words():
    estimator = told(40.0, 20, 5)
    again = ViewpointEstimator.from_arrays(estimator.to_arrays())
    assert again.yaw_rad == estimator.yaw_rad
    for one in (estimator, again):
        tell(one, 40.0, 10, np.random.default_rng(6))
    assert again.yaw_rad == estimator.yaw_rad


@pytest.mark.parametrize(
    ("name", "value"),
    [("yaw", np.zeros(2)), ("yaw", np.array([np.nan, 0.0, 0.0])), ("words", np.zeros((4, 3)))],
)
def test_arrays_of_no_estimator_are_refused(name, value):
    with pytest.raises(ValueError, match=name):
        ViewpointEstimator.from_arrays(told(0.0, 3, 0).to_arrays() | {name: value})


def seen(azimuth_rad: float) -> PairHistograms:
    """Points in one direction, level with the reference."""
    position = np.zeros(POSITION_BINS)
    position[6 * 24 + int((azimuth_rad / math.tau + 0.5) * 24) % 24] = 1.0
    distance = np.zeros(DISTANCE_BINS)
    distance[15] = 1.0
    return PairHistograms(position, distance, math.remainder(azimuth_rad, math.tau))


def example(relation, azimuth_rad, source=Source.HUMAN) -> Example:
    return Example(relation, seen(azimuth_rad), seen(azimuth_rad + math.pi), source)


def test_an_example_teaches_the_converse_too():
    memory = GroundingMemory()
    memory.learn([example(Position.LEFT, 3.0), example(Distance.FAR, 3.0)])
    left, right, far = (
        memory.model.position_histogram(Position.LEFT),
        memory.model.position_histogram(Position.RIGHT),
        memory.model.distance_histogram(Distance.FAR),
    )
    np.testing.assert_array_equal(left, seen(3.0).position)
    np.testing.assert_array_equal(right, seen(3.0 + math.pi).position)
    np.testing.assert_array_equal(far, seen(3.0).distance)
    assert memory.model.counts.sum() == 4


def test_peoples_words_turn_the_axes_and_what_was_learned_stays():
    memory = GroundingMemory()
    rng = np.random.default_rng(1)
    old = [rng.uniform(-math.pi, math.pi) for _ in range(40)]
    memory.learn([example(word(azimuth, 0.0), azimuth, Source.QSR) for azimuth in old])
    assert memory.yaw_rad == 0.0
    weights = memory.to_arrays()["weights"].copy()
    new = [rng.uniform(-math.pi, math.pi) for _ in range(20)]
    quarter = math.pi / 2.0
    words = [example(word(azimuth, quarter), azimuth) for azimuth in new]
    memory.learn(words, agreement_dropped=True)
    assert memory.yaw_rad == pytest.approx(quarter, abs=0.25)
    assert (memory.to_arrays()["weights"] >= weights).all()


def test_what_no_angle_explains_makes_the_old_fade():
    memory = GroundingMemory()
    memory.learn([example(Position.ABOVE, 0.3, Source.QSR)] * 30)
    memory.learn([example(Position.ABOVE, 0.3)], agreement_dropped=True)
    assert memory.to_arrays()["weights"].max() == 1.0


def test_arrays_keep_the_memory():
    memory = GroundingMemory()
    memory.learn([example(word(0.1 * n, 1.0), 0.1 * n) for n in range(60)])
    again = GroundingMemory.from_arrays(memory.to_arrays())
    assert again.yaw_rad == memory.yaw_rad
    np.testing.assert_array_equal(again.model.counts, memory.model.counts)
