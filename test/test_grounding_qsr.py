"""The qualitative model, on geometry whose relations are known by construction."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.grounding.extent import Extent
from ros_scenesense.grounding.qsr import IMPROVED, PYRAMIDS, ground_pairs, measure_distances
from ros_scenesense.scene import Distance, Position

RULES = (PYRAMIDS, IMPROVED)


# Far away, so that no object is thought to have a hidden back in any other direction than away.
VIEWPOINT = np.array([0.0, -50.0, 0.0])


def name(extents, rule=PYRAMIDS, viewpoint=VIEWPOINT):
    distances = measure_distances(extents, viewpoint, rule)
    return ground_pairs(extents, distances, viewpoint, rule)


DIRECTIONS = {
    Position.RIGHT: (1.0, 0.0, 0.0),
    Position.LEFT: (-1.0, 0.0, 0.0),
    Position.BEHIND: (0.0, 1.0, 0.0),
    Position.FRONT: (0.0, -1.0, 0.0),
    Position.ABOVE: (0.0, 0.0, 1.0),
    Position.BELOW: (0.0, 0.0, -1.0),
}


def block(centre, size=(0.1, 0.1, 0.1), count: int = 200, seed: int = 0) -> Extent:
    """A solid box of random points about a centre, in axes (right, away, up)."""
    half = np.asarray(size) / 2.0
    points = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3)) * half + centre
    return Extent(points, points.min(axis=0), points.max(axis=0))


def moved(extent: Extent, shift) -> Extent:
    return Extent(extent.points + shift, extent.low + shift, extent.high + shift)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("position", list(DIRECTIONS))
@pytest.mark.parametrize(
    ("gap", "distance"),
    [(0.0, Distance.TOUCHING), (0.3, Distance.NOT_TOUCHING), (1.5, Distance.FAR)],
)
def test_names_every_direction_and_distance(position, gap, distance, rule):
    away = np.asarray(DIRECTIONS[position]) * (0.1 + gap)
    # Many points, so that the closest tenth of two boxes face to face is within a centimetre.
    pair = [block(away, count=4000, seed=1), block((0, 0, 0), count=4000, seed=2)]
    said = name(pair, rule)
    assert said[0, 1].position is position
    assert said[1, 0].position is position.converse
    assert said[0, 1].distance is said[1, 0].distance is distance
    assert said[0, 1].position_confidence > 0.9


@pytest.mark.parametrize("rule", RULES)
def test_what_is_mostly_inside_the_box_is_in(rule):
    bowl = block((0.0, 0.0, 0.0), (0.3, 0.3, 0.2))
    apple = block((0.05, 0.0, 0.04), (0.08, 0.08, 0.08))
    said = name([apple, bowl], rule)
    assert said[0, 1].position is Position.IN
    assert said[0, 1].position_confidence > 0.9
    assert said[1, 0].position is not Position.IN


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize(("height", "is_in"), [(0.145, True), (0.16, False)])
def test_in_needs_most_of_the_points(height, is_in, rule):
    bowl = block((0.0, 0.0, 0.0), (0.4, 0.4, 0.3), count=3000)
    # The rim is at .15: of a ball 10 cm high, 55 % are below it, or 40 %.
    ball = block((0.0, 0.0, height), (0.1, 0.1, 0.1), count=3000, seed=1)
    said = name([ball, bowl], rule)[0, 1]
    assert (said.position is Position.IN) == is_in
    assert is_in or said.position is Position.ABOVE


def test_confidence_is_the_share_of_points_in_the_winning_pyramid():
    reference = block((0.0, 0.0, 0.0))
    points = np.array([[1.0, 0, 0]] * 6 + [[0, 1.0, 0]] * 3 + [[0.0, 0, 0.001]])
    said = name([Extent(points, points.min(axis=0), points.max(axis=0)), reference])[0, 1]
    assert said.position is Position.RIGHT
    assert said.position_confidence == pytest.approx(0.6)


def test_pyramids_open_at_45_degrees_however_flat_the_reference():
    # As a camera sees a box: wide and high, but hardly any depth.
    front_face = block((0.0, 0.0, 0.0), (0.2, 0.01, 0.2))
    assert name([block((0.2, 0.1, 0.0)), front_face])[0, 1].position is Position.RIGHT
    assert name([block((0.1, 0.2, 0.0)), front_face])[0, 1].position is Position.BEHIND


def test_fewer_than_two_objects_have_no_relations():
    assert name([]) == {}
    assert name([block((0, 0, 0))], IMPROVED) == {}


@pytest.mark.parametrize("rule", RULES)
def test_single_points_are_objects_too(rule):
    points = [np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 0.0]]), np.array([[2.0, 0, 0]])]
    said = name([Extent(one, one[0], one[0]) for one in points], rule)
    assert Position.IN in (said[0, 1].position, said[1, 0].position)
    assert (said[2, 0].position, said[2, 0].distance) == (Position.RIGHT, Distance.FAR)


SCENES = st.lists(
    st.tuples(
        st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3),
        st.lists(st.floats(0.01, 0.5), min_size=3, max_size=3),
        st.integers(1, 40),
    ),
    min_size=2,
    max_size=5,
)


def build(scene) -> list[Extent]:
    return [block(centre, size, count, seed) for seed, (centre, size, count) in enumerate(scene)]


@given(SCENES, st.sampled_from(RULES))
def test_every_directed_pair_gets_exactly_one_of_each(scene, rule):
    extents = build(scene)
    said = name(extents, rule)
    count = len(extents)
    assert set(said) == {(i, j) for i in range(count) for j in range(count) if i != j}
    for (i, j), grounding in said.items():
        assert grounding.distance is said[j, i].distance
        assert grounding.distance_confidence == said[j, i].distance_confidence
        assert 0.0 < grounding.position_confidence <= 1.0


@given(SCENES, st.lists(st.integers(-4, 4), min_size=3, max_size=3))
def test_moving_the_whole_scene_changes_nothing(scene, shift):
    # On a grid of 1/1024 m, moving by whole metres rounds nothing.
    extents = [
        Extent(*(np.round(part * 1024.0) / 1024.0 for part in (one.points, one.low, one.high)))
        for one in build(scene)
    ]
    there = [moved(one, np.array(shift, float)) for one in extents]
    there = name(there, PYRAMIDS, VIEWPOINT + shift)
    here = name(extents, PYRAMIDS)
    assert {key: said.position for key, said in there.items()} == {
        key: said.position for key, said in here.items()
    }
    for key, said in there.items():
        assert said.distance_confidence == pytest.approx(here[key].distance_confidence, abs=1e-6)


@given(
    st.sampled_from(list(DIRECTIONS)),
    st.floats(0.25, 2.0),
    st.lists(st.floats(-0.05, 0.05), min_size=3, max_size=3),
    st.lists(st.floats(0.02, 0.2), min_size=6, max_size=6),
    st.sampled_from(RULES),
)
def test_swapping_a_pair_apart_along_an_axis_gives_the_converse(position, gap, aside, sizes, rule):
    axis = np.asarray(DIRECTIONS[position])
    centre = axis * (gap + 0.2) + np.asarray(aside) * (axis == 0.0)
    said = name([block(centre, sizes[:3]), block((0.0, 0.0, 0.0), sizes[3:], seed=1)], rule)
    assert said[0, 1].position is position
    assert said[1, 0].position is position.converse


@given(st.sampled_from(list(DIRECTIONS)[:4]), st.integers(1, 3), st.sampled_from(RULES))
def test_turning_the_viewer_turns_the_names(position, quarters, rule):
    horizontal = [Position.RIGHT, Position.BEHIND, Position.LEFT, Position.FRONT]
    pair = [block(0.4 * np.asarray(DIRECTIONS[position])), block((0.0, 0.0, 0.0), seed=1)]
    turn = np.linalg.matrix_power(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), quarters)
    turned = [
        Extent(p, p.min(axis=0), p.max(axis=0)) for p in (one.points @ turn.T for one in pair)
    ]
    expected = horizontal[(horizontal.index(position) + quarters) % 4]
    assert name(turned, rule)[0, 1].position is expected


def test_a_long_thing_has_others_beside_it_along_all_its_length():
    shelf = block((0.0, 0.0, 0.0), (0.6, 0.1, 0.1))
    mug = block((0.25, 0.2, 0.0))
    assert name([mug, shelf], PYRAMIDS)[0, 1].position is Position.RIGHT
    assert name([mug, shelf], IMPROVED)[0, 1].position is Position.BEHIND


def test_what_stands_on_the_rim_of_something_wide_is_above_it():
    table = block((0.0, 0.0, 0.0), (0.6, 0.6, 0.1))
    mug = block((0.24, 0.0, 0.1))
    assert name([mug, table], PYRAMIDS)[0, 1].position is Position.RIGHT
    assert name([mug, table], IMPROVED)[0, 1].position is Position.ABOVE
