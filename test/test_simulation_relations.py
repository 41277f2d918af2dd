"""Exact relations: what a careful person would say of boxes in space, and of bodies in physics."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.geometry import look_at
from ros_scenesense.scene import Distance, Position
from ros_scenesense.simulation.arrangements import Arrangement, Piece, draw_layout
from ros_scenesense.simulation.catalogue import load_catalogue
from ros_scenesense.simulation.object_files import Color
from ros_scenesense.simulation.relations import (
    Contact,
    ExactRelation,
    exact_relations,
    naming_axes,
)
from ros_scenesense.simulation.solids import Solid, convex_solid
from ros_scenesense.simulation.survey import Surveyor
from ros_scenesense.simulation.world import World

CATALOGUE = load_catalogue()
ROBOT = naming_axes(None)
APART = Contact(0.05, 0.0)
SIGNS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
CONVERSES = {position: position.converse for position in Position if position.converse}


def turn(yaw: float) -> np.ndarray:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def box(
    size: tuple[float, float, float], at: tuple[float, float, float], yaw: float = 0.0
) -> Solid:
    return convex_solid(SIGNS * size).moved(turn(yaw), np.array(at))


def cube(x: float, y: float, z: float, edge: float = 0.05) -> Solid:
    return box((edge, edge, edge), (x, y, z))


def between(
    one: Solid, other: Solid, contact: Contact = APART, axes: np.ndarray = ROBOT
) -> ExactRelation:
    (relation,) = exact_relations(["a", "b"], [one, other], {(0, 1): contact}, axes)
    return relation


@pytest.mark.parametrize(
    ("at", "position"),
    [
        ((0.1, 0.0, 0.0), Position.BEHIND),
        ((-0.1, 0.0, 0.0), Position.FRONT),
        ((0.0, 0.1, 0.0), Position.LEFT),
        ((0.0, -0.1, 0.0), Position.RIGHT),
        ((0.0, 0.0, 0.1), Position.ABOVE),
        ((0.0, 0.0, -0.1), Position.BELOW),
        ((0.1, 0.03, 0.02), Position.BEHIND),
    ],
)
def test_directions_of_the_robot_frame(at: tuple[float, float, float], position: Position) -> None:
    relation = between(cube(*at), cube(0.0, 0.0, 0.0))
    assert (relation.object, relation.reference) == ("a", "b")
    assert relation.position is position
    assert not relation.position_ambiguous


@pytest.mark.parametrize(
    ("degrees", "position", "ambiguous"),
    [
        (30.0, Position.BEHIND, False),
        (40.0, Position.BEHIND, True),
        (50.0, Position.LEFT, True),
        (60.0, Position.LEFT, False),
    ],
)
def test_diagonals_are_ambiguous(degrees: float, position: Position, ambiguous: bool) -> None:
    angle = math.radians(degrees)
    relation = between(cube(0.1 * math.cos(angle), 0.1 * math.sin(angle), 0.0), cube(0, 0, 0))
    assert relation.position is position
    assert relation.position_ambiguous is ambiguous


def test_beside_the_end_of_a_long_box_is_beside_it() -> None:
    relation = between(cube(0.1, -0.1, 0.0), box((0.30, 0.05, 0.05), (0.0, 0.0, 0.0)))
    assert relation.position is Position.RIGHT
    assert not relation.position_ambiguous


def test_the_viewer_names_by_where_it_looks() -> None:
    one, other = cube(0.1, 0.0, 0.0), cube(0.0, 0.0, 0.0)
    views = {
        (-1.0, 0.0, 0.6): Position.BEHIND,
        (1.0, 0.0, 0.6): Position.FRONT,
        (0.0, -1.0, 0.6): Position.RIGHT,
        (0.0, 1.0, 0.6): Position.LEFT,
    }
    for eye, position in views.items():
        axes = naming_axes(look_at(eye, (0.0, 0.0, 0.0)))
        assert between(one, other, axes=axes).position is position
        assert between(cube(0.0, 0.0, 0.2), other, axes=axes).position is Position.ABOVE


def test_what_rests_is_above_however_little_it_overlaps() -> None:
    one, other = cube(0.043, 0.0, 0.05), cube(0.0, 0.0, 0.0)
    for contact, ambiguous in ((Contact(0.0, 1.0), False), (Contact(0.004, 1.0), True)):
        relation = between(one, other, contact)
        assert relation.position is Position.ABOVE
        assert relation.position_ambiguous is ambiguous
    assert between(other, one, Contact(0.0, -1.0)).position is Position.BELOW


def test_a_tall_neighbour_is_not_above() -> None:
    relation = between(box((0.1, 0.1, 0.24), (0.0, 0.1, 0.12)), cube(0.0, 0.0, 0.025))
    assert relation.position is Position.LEFT
    assert not relation.position_ambiguous


def test_what_is_contained_is_in_and_comes_first() -> None:
    jar, ball = box((0.1, 0.1, 0.12), (0.0, 0.0, 0.06)), cube(0.01, 0.0, 0.03)
    relation = between(jar, ball, Contact(0.0, -1.0))
    assert (relation.object, relation.reference) == ("b", "a")
    assert relation.position is Position.IN
    assert not relation.position_ambiguous


@pytest.mark.parametrize(
    ("rise", "position", "ambiguous"),
    [
        (0.015, Position.IN, False),
        (0.021, Position.IN, True),
        (0.029, Position.ABOVE, True),
        (0.050, Position.ABOVE, False),
    ],
)
def test_half_of_it_must_be_inside(rise: float, position: Position, ambiguous: bool) -> None:
    relation = between(
        cube(0.0, 0.0, 0.075 + rise), box((0.1, 0.1, 0.1), (0.0, 0.0, 0.05)), Contact(0.0, 1.0)
    )
    assert relation.position is position
    assert relation.position_ambiguous is ambiguous


@pytest.mark.parametrize(
    ("distance_m", "distance", "ambiguous"),
    [
        (0.0, Distance.TOUCHING, False),
        (0.002, Distance.TOUCHING, False),
        (0.005, Distance.NOT_TOUCHING, True),
        (0.02, Distance.NOT_TOUCHING, False),
        (0.97, Distance.NOT_TOUCHING, True),
        (1.0, Distance.FAR, True),
        (1.2, Distance.FAR, False),
    ],
)
def test_distances(distance_m: float, distance: Distance, ambiguous: bool) -> None:
    relation = between(cube(0.0, 1.0, 0.0), cube(0.0, 0.0, 0.0), Contact(distance_m, 0.0))
    assert relation.distance is distance
    assert relation.distance_ambiguous is ambiguous
    assert relation.distance_m == distance_m


def test_straight_above_something_counts_only_over_it() -> None:
    slab, small = box((0.2, 0.2, 0.02), (0.0, 0.0, 0.0)), cube(0.05, 0.05, 0.5)
    assert small.share_over(slab) == 1.0
    assert 0.02 < slab.share_over(small) < 0.12
    assert box((0.05, 0.05, 0.05), (0.1, 0.0, 0.5)).share_over(slab) == pytest.approx(0.5, abs=0.06)
    assert cube(0.2, 0.0, 0.5).share_over(slab) == 0.0


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    world = World(CATALOGUE)
    yield world
    world.close()


@pytest.fixture(scope="module")
def surveyor(world: World) -> Surveyor:
    return Surveyor(world)


def survey(world: World, surveyor: Surveyor, axes: np.ndarray) -> list[ExactRelation]:
    names = [body.piece.name for body in world.bodies]
    return exact_relations(names, surveyor.solids(), surveyor.contacts(), axes)


def test_what_a_layout_stacks_is_above_and_touches(world: World, surveyor: Surveyor) -> None:
    for seed in range(12):
        layout = draw_layout(CATALOGUE, Arrangement.MIXED, seed, 0.0, np.random.default_rng(seed))
        world.build(layout.pieces)
        supports = set(layout.supports())
        for relation in survey(world, surveyor, ROBOT):
            pair = (relation.object, relation.reference)
            stacked = pair in supports or pair[::-1] in supports
            assert (relation.distance is Distance.TOUCHING) is stacked
            if stacked:
                position = Position.ABOVE if pair in supports else Position.BELOW
                assert relation.position is position
                assert not relation.position_ambiguous


def test_what_touches_sideways_is_beside(world: World, surveyor: Surveyor) -> None:
    item = CATALOGUE["large_cube"]
    pieces = [
        Piece(item, Color.RED, 0.0, 0.0, 0.0),
        Piece(item, Color.BLUE, 0.0, item.width_m + 0.0005, 0.0),
    ]
    world.build(pieces)
    (relation,) = survey(world, surveyor, ROBOT)
    assert relation.object.startswith("blue")
    assert relation.position is Position.LEFT
    assert relation.distance is Distance.TOUCHING
    assert not relation.position_ambiguous


seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=40, deadline=None)
@given(seed=seeds)
def test_relations_of_random_solids(seed: int) -> None:
    """Order and names do not matter; the scene and its viewer may turn together."""
    rng = np.random.default_rng(seed)
    solids = [
        box(tuple(rng.uniform(0.03, 0.2, 3)), tuple(rng.uniform(-0.25, 0.25, 3)), rng.uniform(0, 6))
        for _ in range(4)
    ]
    names = ["a", "b", "c", "d"]
    contacts = {
        (i, j): Contact(float(rng.uniform(0.0, 0.01)), float(rng.uniform(-1.0, 1.0)))
        for j in range(4)
        for i in range(j)
    }
    relations = exact_relations(names, solids, contacts, ROBOT)
    assert [(min(r.object, r.reference), max(r.object, r.reference)) for r in relations] == [
        (names[i], names[j]) for i in range(4) for j in range(i + 1, 4)
    ]

    order = [int(i) for i in rng.permutation(4)]
    shuffled = {}
    for (i, j), contact in contacts.items():
        k, m = order.index(i), order.index(j)
        up = contact.up if k < m else -contact.up
        shuffled[min(k, m), max(k, m)] = Contact(contact.distance_m, up)
    moved = [solids[i] for i in order]
    assert exact_relations([names[i] for i in order], moved, shuffled, ROBOT) == relations

    # With the names reversed the same pairs are named the other way round.
    rename = dict(zip(names[::-1], names, strict=True))
    twins = {frozenset((relation.object, relation.reference)): relation for relation in relations}
    for relation in exact_relations(names[::-1], solids, contacts, ROBOT):
        twin = twins[frozenset((rename[relation.object], rename[relation.reference]))]
        assert relation.position_ambiguous == twin.position_ambiguous
        assert (relation.distance, relation.distance_m) == (twin.distance, twin.distance_m)
        back = (rename[relation.object], rename[relation.reference], relation.position)
        if relation.position is Position.IN:
            assert back == (twin.object, twin.reference, twin.position)
        else:
            assert back == (twin.reference, twin.object, CONVERSES[twin.position])

    yaw = rng.uniform(-math.pi, math.pi)
    turned = [solid.moved(turn(yaw), np.array([0.3, -0.2, 0.1])) for solid in solids]
    assert exact_relations(names, turned, contacts, ROBOT @ turn(yaw).T) == relations


@settings(max_examples=20, deadline=None)
@given(seed=seeds)
def test_a_quarter_turn_of_the_scene_shifts_the_words(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, other = (
        box((0.05, 0.08, 0.05), tuple(rng.uniform(-0.2, 0.2, 3)), rng.uniform(0, 6))
        for _ in range(2)
    )
    before = between(one, other)
    quarter = turn(math.pi / 2.0)
    after = between(one.moved(quarter, np.zeros(3)), other.moved(quarter, np.zeros(3)))
    words = {
        Position.BEHIND: Position.LEFT,
        Position.LEFT: Position.FRONT,
        Position.FRONT: Position.RIGHT,
        Position.RIGHT: Position.BEHIND,
    }
    if not before.position_ambiguous:
        assert after.position is words.get(before.position, before.position)


def test_a_catalogue_item_is_as_large_as_its_solid(world: World, surveyor: Surveyor) -> None:
    for item in CATALOGUE.values():
        world.build([Piece(item, Color.RED, 0.0, 0.0, 0.3)])
        (solid,) = surveyor.solids()
        height = np.ptp(solid.vertices[:, 2])
        assert height == pytest.approx(item.height_m, rel=0.03), item
        assert solid.vertices[:, 2].min() == pytest.approx(0.0, abs=0.002)
        assert len(solid.samples) == 128
        assert solid.share_inside(solid) == 1.0
