"""Touching, not touching, far; and what of a gap between stacked objects was seen."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from ros_scenesense.grounding.contact import seen_gaps
from ros_scenesense.grounding.distances import (
    closest_distance,
    closest_distances,
    distance_relations,
    name_distance,
)
from ros_scenesense.grounding.extent import Extent, completed
from ros_scenesense.grounding.qsr import IMPROVED, PYRAMIDS, measure_distances
from ros_scenesense.scene import Distance


def wall(x: float, count: int = 400) -> np.ndarray:
    """Points of a 10 cm square across x, seen from the side."""
    rows = int(np.sqrt(count))
    y, z = np.meshgrid(np.linspace(0.0, 0.1, rows), np.linspace(0.0, 0.1, rows))
    return np.stack([np.full(y.size, x), y.ravel(), z.ravel()], axis=1)


def relations(clouds):
    return distance_relations(closest_distances(clouds))


def seen_relation(*extents):
    return distance_relations(measure_distances(extents, CAMERA))[0, 1][0]


@pytest.mark.parametrize(
    ("gap", "expected"),
    [
        (0.0, Distance.TOUCHING),
        (0.0099, Distance.TOUCHING),
        (0.0101, Distance.NOT_TOUCHING),
        (0.5, Distance.NOT_TOUCHING),
        (0.9999, Distance.NOT_TOUCHING),
        (1.0001, Distance.FAR),
        (3.0, Distance.FAR),
    ],
)
def test_thresholds_of_the_paper(gap, expected):
    relation, confidence = relations([wall(0.0), wall(gap)])[0, 1]
    assert relation is expected
    assert 0.5 <= confidence <= 1.0


def test_the_thresholds_themselves_belong_to_touching_and_far():
    assert name_distance(0.01) == (Distance.TOUCHING, 0.5)
    assert name_distance(1.0) == (Distance.FAR, 0.5)


def test_confidence_is_the_margin_to_the_nearest_threshold():
    confidences = [name_distance(d)[1] for d in (0.0, 0.005, 0.015, 0.02, 0.5, 0.95, 1.05, 2.0)]
    assert confidences == pytest.approx([1.0, 0.75, 0.75, 1.0, 1.0, 0.75, 0.75, 1.0])


def test_distance_is_the_mean_of_the_closest_tenth():
    # 100 points at distances 1, 2, ... 100 cm from a single point: the closest ten, 1 to 10 cm.
    line = np.stack([np.arange(1, 101) / 100.0, np.zeros(100), np.zeros(100)], axis=1)
    point = np.zeros((100, 3))
    first, second = cKDTree(line), cKDTree(point)
    # From the point's side all 100 (equal) points are 1 cm away, the smaller of the two.
    assert closest_distance(first, second) == pytest.approx(0.01)
    far_points = np.concatenate([np.zeros((1, 3)), np.full((99, 3), -5.0)])
    assert closest_distance(first, cKDTree(far_points)) == pytest.approx(0.055)


CLOUD_PAIRS = st.tuples(
    st.integers(0, 2**32 - 1),
    st.lists(st.floats(-1.2, 1.2), min_size=3, max_size=3),
    st.floats(0.001, 0.3),
    st.integers(1, 60),
)


@given(CLOUD_PAIRS)
def test_boxes_far_apart_spare_the_search_and_change_nothing(case):
    seed, shift, scale, count = case
    rng = np.random.default_rng(seed)
    first = rng.uniform(-scale, scale, (40, 3))
    second = rng.uniform(-scale, scale, (count, 3)) + shift
    full = name_distance(closest_distance(cKDTree(first), cKDTree(second)))
    assert relations([first, second])[0, 1] == full


@given(CLOUD_PAIRS)
def test_distance_is_symmetric_and_moves_with_the_scene(case):
    seed, shift, scale, count = case
    rng = np.random.default_rng(seed)
    first = rng.uniform(-scale, scale, (40, 3))
    second = rng.uniform(-scale, scale, (count, 3)) + shift
    distance = closest_distance(cKDTree(first), cKDTree(second))
    assert closest_distance(cKDTree(second), cKDTree(first)) == distance
    moved = [cKDTree(cloud + np.array([3.0, -2.0, 1.0])) for cloud in (first, second)]
    assert closest_distance(*moved) == pytest.approx(distance, abs=1e-9)


def extent(low: tuple[float, float, float], size: tuple[float, float, float]) -> Extent:
    """What a camera far in front sees of a box: its front face."""
    x, z = np.meshgrid(np.linspace(0.0, size[0], 20), np.linspace(0.0, size[2], 20))
    points = np.asarray(low) + np.stack([x.ravel(), np.zeros(400), z.ravel()], axis=1)
    return Extent(points, np.asarray(low), np.asarray(low) + size)


CAMERA = np.array([0.0, -1.0, 0.5])
LOWER = extent((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))


def gap_between(upper: Extent, lower: Extent = LOWER, viewpoint: np.ndarray = CAMERA) -> float:
    gaps = seen_gaps([upper, lower], viewpoint)
    np.testing.assert_array_equal(gaps, gaps.T)
    return float(gaps[0, 1])


def test_a_contact_behind_an_overhang_is_hidden_and_no_gap_is_seen():
    # The upper box juts out by 4 cm, so the upper 1.6 cm of the lower one are hidden.
    juts_out = extent((0.0, -0.04, 0.1), (0.1, 0.1, 0.1))
    assert gap_between(juts_out) == 0.0
    visible_lower = Extent(LOWER.points, LOWER.low, LOWER.high - [0.0, 0.0, 0.016])
    assert gap_between(juts_out, visible_lower) == 0.0
    assert seen_relation(juts_out, visible_lower) is Distance.TOUCHING


def test_a_gap_that_is_seen_remains_a_gap():
    hovering = extent((0.0, 0.0, 0.2), (0.1, 0.1, 0.1))
    assert 0.05 < gap_between(hovering) < 0.1
    assert seen_relation(hovering, LOWER) is Distance.NOT_TOUCHING


@pytest.mark.parametrize(
    "beside",
    [
        extent((0.15, 0.0, 0.1), (0.1, 0.1, 0.1)),  # higher, but to the right
        extent((0.0, 0.3, 0.1), (0.1, 0.1, 0.1)),  # higher, but behind
        extent((0.05, 0.0, 0.0), (0.1, 0.1, 0.1)),  # interleaved, of one height
        extent((0.12, 0.0, 0.0), (0.1, 0.1, 0.1)),  # beside
    ],
    ids=["right", "behind", "interleaved", "beside"],
)
def test_objects_that_are_not_stacked_have_no_seen_gap(beside):
    assert gap_between(beside) == np.inf


def test_objects_of_which_only_the_front_is_seen_are_as_deep_as_wide():
    upper = extent((0.0, -0.04, 0.1), (0.1, 0.001, 0.1))
    lower = extent((0.0, 0.0, 0.0), (0.1, 0.001, 0.1))
    assert gap_between(upper, lower) == 0.0
    too_far_back = extent((0.0, 0.11, 0.1), (0.1, 0.001, 0.1))
    assert gap_between(too_far_back, lower) == np.inf


def test_an_object_between_keeps_two_others_apart():
    tower = [extent((0.0, 0.0, level), (0.1, 0.1, 0.05)) for level in (0.0, 0.05, 0.1)]
    gaps = seen_gaps(tower, CAMERA)
    assert gaps[0, 1] == gaps[1, 2] == 0.0
    assert gaps[0, 2] == np.inf


@settings(max_examples=50)
@given(st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3))
def test_only_where_the_camera_stands_to_the_objects_matters(shift):
    moved = [
        Extent(one.points + shift, one.low + shift, one.high + shift)
        for one in (extent((0.02, -0.03, 0.13), (0.1, 0.1, 0.1)), LOWER)
    ]
    expected = gap_between(extent((0.02, -0.03, 0.13), (0.1, 0.1, 0.1)))
    assert gap_between(*moved, CAMERA + shift) == pytest.approx(expected, abs=1e-9)


def facing(gap: float) -> list[Extent]:
    """Two boxes beside each other, seen from the front."""
    return [extent((0.1 + gap, 0.0, 0.0), (0.1, 0.1, 0.1)), LOWER]


@pytest.mark.parametrize(
    ("rule", "gap", "expected"),
    [
        (IMPROVED, 0.015, Distance.TOUCHING),
        (IMPROVED, 0.03, Distance.NOT_TOUCHING),
        (PYRAMIDS, 0.015, Distance.NOT_TOUCHING),
        (PYRAMIDS, 0.002, Distance.TOUCHING),
    ],
)
def test_what_is_seen_at_a_grazing_angle_may_touch_a_centimetre_away(rule, gap, expected):
    distances = measure_distances(facing(gap), CAMERA, rule)
    assert distance_relations(distances)[0, 1][0] is expected


def test_what_is_in_a_container_touches_it():
    rng = np.random.default_rng(0)
    walls = rng.uniform(-0.1, 0.1, (2000, 3))
    walls = walls[np.abs(walls[:, :2]).max(axis=1) > 0.09]
    ball = rng.uniform(-0.06, 0.06, (500, 3)) + np.array([0.017, 0.0, -0.03])
    for rule, expected in ((IMPROVED, Distance.TOUCHING), (PYRAMIDS, Distance.NOT_TOUCHING)):
        seen = [Extent(one, one.min(axis=0), one.max(axis=0)) for one in (ball, walls)]
        distances = measure_distances(seen, CAMERA, rule)
        assert 0.01 < measure_distances(seen, CAMERA, PYRAMIDS)[0, 1].mean() < 0.024
        assert distance_relations(distances)[0, 1][0] is expected


@pytest.mark.parametrize("azimuth_deg", [0.0, 40.0, 90.0, 200.0])
def test_boxes_are_completed_along_the_line_of_sight(azimuth_deg):
    angle = np.radians(azimuth_deg)
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    across = np.array([-np.sin(angle), np.cos(angle), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    side, height = (one.ravel() for one in np.meshgrid(*[np.linspace(-0.05, 0.05, 101)] * 2))
    # What is seen of something: a square across.
    points = along + side[:, None] * across + height[:, None] * up
    low, high = completed([Extent(points, points.min(axis=0), points.max(axis=0))], np.zeros(3))
    hidden = 0.094 * along  # from the 3rd to the 97th percentile
    np.testing.assert_allclose(low[0], np.minimum(points, points + hidden).min(axis=0), atol=1e-9)
    np.testing.assert_allclose(high[0], np.maximum(points, points + hidden).max(axis=0), atol=1e-9)
