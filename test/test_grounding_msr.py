"""The metric model: histograms of pairs, what is learned from them, and how it is kept."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.grounding.extent import Extent
from ros_scenesense.grounding.histograms import (
    DISTANCE_BINS,
    POSITION_BINS,
    PairHistograms,
    describe,
    turn,
)
from ros_scenesense.grounding.msr import MetricModel, MetricSettings, Source, chi_squared
from ros_scenesense.grounding.qsr import measure_distances
from ros_scenesense.scene import Distance, Position

VIEWPOINT = np.array([0.0, -5.0, 0.0])
DIRECTIONS = {
    Position.RIGHT: (1.0, 0.0, 0.0),
    Position.LEFT: (-1.0, 0.0, 0.0),
    Position.BEHIND: (0.0, 1.0, 0.0),
    Position.FRONT: (0.0, -1.0, 0.0),
    Position.ABOVE: (0.0, 0.0, 1.0),
    Position.BELOW: (0.0, 0.0, -1.0),
    Position.IN: (0.0, 0.0, 0.0),
}


def block(centre, edge: float = 0.1, seed: int = 0) -> Extent:
    points = np.random.default_rng(seed).uniform(-edge / 2, edge / 2, (300, 3)) + centre
    return Extent(points, points.min(axis=0), points.max(axis=0))


def scene(*extents: Extent, yaw_rad: float = 0.0):
    return describe(extents, measure_distances(extents, VIEWPOINT), VIEWPOINT, yaw_rad)


def pair(position: Position, far_m: float = 0.3, seed: int = 1) -> PairHistograms:
    offset = far_m * np.asarray(DIRECTIONS[position])
    edge = 0.05 if position is Position.IN else 0.1
    return scene(block(offset, edge, seed), block((0.0, 0.0, 0.0), 0.12)).pair(0, 1)


def taught(**settings) -> MetricModel:
    model = MetricModel(MetricSettings(**settings))
    for position in Position:
        model.learn(position, pair(position), Source.HUMAN)
    for distance, metres in zip(Distance, (0.1, 0.4, 1.5), strict=True):
        model.learn(distance, pair(Position.RIGHT, metres), Source.HUMAN)
    return model


@given(st.lists(st.tuples(*[st.floats(-2.0, 2.0)] * 3), min_size=1, max_size=4))
def test_histograms_are_normalised(centres):
    seen = scene(*(block(centre, seed=seed) for seed, centre in enumerate(centres)))
    pairs = [(i, j) for i in range(len(centres)) for j in range(len(centres)) if i != j]
    for i, j in pairs:
        assert seen.position[i, j].sum() == pytest.approx(1.0)
        assert seen.distance[i, j].sum() == pytest.approx(1.0)
        assert (seen.position[i, j] >= 0.0).all()


def test_the_number_of_points_does_not_matter():
    points = block((0.3, 0.1, 0.0)).points
    doubled = np.concatenate([points, points])
    once, twice = (Extent(p, points.min(axis=0), points.max(axis=0)) for p in (points, doubled))
    other = block((0.0, 0.0, 0.0))
    np.testing.assert_allclose(
        scene(once, other).position[0, 1], scene(twice, other).position[0, 1]
    )


def test_what_is_inside_is_in_a_bin_of_its_own():
    assert pair(Position.IN).position[-1] == 1.0
    assert pair(Position.LEFT).position[-1] == 0.0


@pytest.mark.parametrize("position", list(Position))
def test_one_example_of_each_is_enough_to_name_clear_pairs(position):
    offset = 0.4 * np.asarray(DIRECTIONS[position]) + [0.01, -0.02, 0.01]
    edge = 0.06 if position is Position.IN else 0.08
    said = taught().ground(scene(block(offset, edge, 7), block((0.0, 0.0, 0.0), 0.14, 8)))
    assert said[0, 1].position is position
    assert 0.5 < said[0, 1].position_confidence <= 1.0
    if position.converse is not None:
        assert said[1, 0].position is position.converse


@pytest.mark.parametrize(
    ("metres", "distance"),
    [(0.101, Distance.TOUCHING), (0.39, Distance.NOT_TOUCHING), (1.5, Distance.FAR)],
)
def test_distances_are_named_by_intersection(metres, distance):
    said = taught().ground(scene(block((metres, 0, 0), seed=5), block((0, 0, 0), seed=6)))
    assert said[0, 1].distance is said[1, 0].distance is distance


def test_a_model_without_examples_of_both_kinds_says_nothing():
    seen = scene(block((0.4, 0.0, 0.0)), block((0.0, 0.0, 0.0)))
    model = MetricModel()
    assert model.ground(seen) == {}
    model.learn(Position.RIGHT, seen.pair(0, 1), Source.HUMAN)
    assert model.ground(seen) == {}
    model.learn(Distance.NOT_TOUCHING, seen.pair(0, 1), Source.HUMAN)
    assert model.ground(seen)[0, 1].position is Position.RIGHT


def test_chi_squared_is_the_measure_of_the_paper():
    one, other = np.array([0.5, 0.5, 0.0]), np.array([0.25, 0.25, 0.5])
    expected = 2 * 0.25**2 / (2 * 0.75) + 0.5**2 / (2 * 0.5)
    assert chi_squared(one, other) == pytest.approx(expected)
    assert chi_squared(one, one) == 0.0
    assert chi_squared(np.array([1.0, 0.0]), np.array([0.0, 1.0])) == pytest.approx(1.0)


def test_examples_are_counted_by_source():
    model = MetricModel()
    model.learn(Position.LEFT, pair(Position.LEFT), Source.QSR)
    model.learn(Position.LEFT, pair(Position.LEFT), Source.QSR)
    model.learn(Distance.FAR, pair(Position.LEFT, 1.5), Source.HUMAN)
    assert model.counts.sum() == 3
    assert model.counts[list(Position).index(Position.LEFT)].tolist() == [2, 0, 0]
    assert model.counts[len(Position) + list(Distance).index(Distance.FAR)].tolist() == [0, 0, 1]


def test_a_person_counts_more_than_the_qualitative_model_and_own_words_least():
    left, right = pair(Position.LEFT), pair(Position.RIGHT)
    model = MetricModel()
    model.learn(Position.LEFT, right, Source.QSR)
    model.learn(Position.LEFT, left, Source.HUMAN)
    for _ in range(100):
        model.learn(Position.LEFT, right, Source.MSR)
    meaning = model.position_histogram(Position.LEFT)
    # One of the QSR and five for the person; what the model said itself is at most half of that.
    np.testing.assert_allclose(meaning, (4 * right.position + 5 * left.position) / 9)


@given(st.integers(1, 30), st.integers(0, 30))
def test_means_are_running_means_of_the_examples(count, seed):
    rng = np.random.default_rng(seed)
    examples = rng.dirichlet(np.ones(POSITION_BINS), count)
    near = np.full(DISTANCE_BINS, 1.0 / DISTANCE_BINS)
    model = MetricModel()
    for example in examples:
        model.learn(Position.IN, PairHistograms(example, near, 0.0), Source.QSR)
    np.testing.assert_allclose(model.position_histogram(Position.IN), examples.mean(axis=0))


def test_after_fading_one_new_example_counts_as_much_as_all_old_ones():
    left, right = pair(Position.LEFT), pair(Position.RIGHT)
    model = MetricModel()
    for _ in range(50):
        model.learn(Position.LEFT, left, Source.QSR)
    model.fade()
    model.learn(Position.LEFT, right, Source.QSR)
    expected = (left.position + right.position) / 2.0
    np.testing.assert_allclose(model.position_histogram(Position.LEFT), expected)
    assert model.counts.sum() == 51


def test_arrays_keep_everything():
    model = taught()
    again = MetricModel.from_arrays(model.to_arrays())
    seen = scene(block((0.3, 0.2, 0.0)), block((0.0, 0.0, 0.0)), block((0.0, 0.0, 0.4)))
    assert again.ground(seen) == model.ground(seen)
    np.testing.assert_array_equal(again.counts, model.counts)
    again.learn(Position.LEFT, pair(Position.RIGHT), Source.QSR)
    assert again.counts.sum() == model.counts.sum() + 1


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("position", None, "missing"),
        ("counts", np.zeros((2, 3)), "of shape"),
        ("weights", np.full((10, 3), np.nan), "negative numbers or none"),
        ("distance", np.full((3, 3, DISTANCE_BINS), -1.0), "negative numbers or none"),
    ],
)
def test_arrays_of_no_model_are_refused(name, value, words):
    arrays = taught().to_arrays()
    if value is None:
        del arrays[name]
    else:
        arrays[name] = value
    with pytest.raises(ValueError, match=words):
        MetricModel.from_arrays(arrays)


@given(st.floats(-math.pi, math.pi))
def test_turning_keeps_the_sum_and_turning_back_keeps_the_middle(yaw):
    seen = pair(Position.RIGHT)
    there = seen.along(yaw)
    assert there.position.sum() == pytest.approx(1.0)
    back = there.along(0.0)
    assert back.yaw_rad == 0.0
    assert math.isclose(math.remainder(back.azimuth_rad - seen.azimuth_rad, 2 * math.pi), 0.0,
                        abs_tol=1e-9)  # fmt: skip
    assert chi_squared(back.position, seen.position) < 0.05


def test_turned_histograms_are_those_along_turned_axes():
    extents = [block((0.3, 0.1, 0.05), seed=3), block((0.0, 0.0, 0.0), seed=4)]
    yaw = math.radians(30.0)  # two bins
    cosine, sine = math.cos(yaw), math.sin(yaw)
    axes = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    points = [one.points @ axes.T for one in extents]
    along = scene(*(Extent(p, p.min(axis=0), p.max(axis=0)) for p in points), yaw_rad=yaw)
    expected = scene(*extents).pair(0, 1).along(yaw)
    assert along.pair(0, 1).azimuth_rad == pytest.approx(expected.azimuth_rad, abs=0.05)
    assert chi_squared(along.pair(0, 1).position, expected.position) < 0.05
    assert expected.yaw_rad == along.yaw_rad


def test_turning_by_whole_bins_shifts_them():
    histogram = np.zeros(POSITION_BINS)
    histogram[5] = 1.0
    assert turn(histogram, math.radians(30.0))[3] == pytest.approx(1.0)
