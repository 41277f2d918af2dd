"""Scenes for experiments on prepositions: what is drawn, and what physics makes of it."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.errors import SimulationError
from ros_scenesense.scene import Distance, Position, Truth
from ros_scenesense.simulation.arrangements import Arrangement, Layout, Piece, draw_layout
from ros_scenesense.simulation.catalogue import Catalogue, load_catalogue
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.object_files import Color
from ros_scenesense.simulation.rooms import measure_room
from ros_scenesense.simulation.table import TABLE_EDGE_M
from ros_scenesense.simulation.world import World

CATALOGUE = load_catalogue()
CONTAINERS = ["mug", "pitcher", "open_box", "tray"]


def draw(seed: int, catalogue: Catalogue = CATALOGUE) -> Layout:
    rng = np.random.default_rng(seed)
    return draw_layout(catalogue, Arrangement.RELATIONS, 0, (seed % 7 - 3) / 3, rng)


@settings(deadline=None, max_examples=80)
@given(st.integers(0, 2**32))
def test_groups_stand_apart_on_the_table(seed: int) -> None:
    pieces = draw(seed).pieces
    assert len({piece.color for piece in pieces}) == 5
    assert pieces[1].support == 0
    assert pieces[3].support in (None, 2)
    for piece in pieces:
        assert max(abs(piece.x_m), abs(piece.y_m)) + piece.item.radius_m < TABLE_EDGE_M / 2.0
    groups = (pieces[:2], pieces[2:4], pieces[4:])
    for number, group in enumerate(groups):
        for piece in group:
            for other in (other for apart in groups[:number] for other in apart):
                distance = math.hypot(piece.x_m - other.x_m, piece.y_m - other.y_m)
                assert distance - piece.item.radius_m - other.item.radius_m >= 0.02 - 1e-9


def test_every_container_is_used() -> None:
    layouts = [draw(seed) for seed in range(80)]
    used = {layout.pieces[2].item.name for layout in layouts if not layout.pushed}
    assert used == set(CONTAINERS)
    assert 0.2 < sum(bool(layout.pushed) for layout in layouts) / len(layouts) < 0.5


@pytest.mark.parametrize("name", CONTAINERS)
def test_a_container_has_the_room_that_it_is_made_with(name: str) -> None:
    item = CATALOGUE[name]
    room = CATALOGUE.room(item)
    floor = {"mug": 0.006, "pitcher": 0.004, "open_box": 0.004, "tray": 0.005}[name]
    half = {"mug": 0.0355, "pitcher": 0.051, "open_box": 0.056, "tray": 0.075}[name]
    depth = item.height_m - floor
    assert room.depths.max() == pytest.approx(depth, abs=1e-6)
    assert len(room.fitting(half - 0.006, depth - 1e-6))
    assert not len(room.fitting(half + 0.001, depth - 1e-6))
    assert not len(room.fitting(0.01, depth + 0.001))


def test_containers_without_room_are_passed_over(tmp_path: Path) -> None:
    entry = "- {name: %s, shape: %s, size: large, surface: irregular, mass_kg: 0.1, open: true, "
    entry += "box: {size_m: [0.1, 0.1, 0.1]}}\n"
    file = tmp_path / "mine.yaml"
    file.write_text("".join(entry % (name, name) for name in CONTAINERS[:3]))
    layouts = [draw(seed, load_catalogue(str(tmp_path))) for seed in range(10)]
    assert {layout.pieces[2].item.name for layout in layouts if not layout.pushed} == {"tray"}
    file.write_text("".join(entry % (name, name) for name in CONTAINERS))
    catalogue = load_catalogue(str(tmp_path))
    with pytest.raises(SimulationError, match=r"no open \w+ object has room for a \w+ one"):
        [draw(seed, catalogue) for seed in range(10)]


def test_what_is_massive_has_no_room() -> None:
    for name in ("medium_cube", "apple", "large_sphere"):
        assert not len(measure_room(CATALOGUE.form(CATALOGUE[name])).fitting(0.005, 0.03))


def test_a_pushed_body_touches_and_stays_on_the_table() -> None:
    pieces = [
        Piece(CATALOGUE["small_sphere"], Color.RED, 0.0, 0.0, 0.0),
        Piece(CATALOGUE["large_sphere"], Color.BLUE, 0.3, 0.1, 0.0),
    ]
    world = World(CATALOGUE)
    one, other = world.build(pieces, [(1, 0)])
    x, y, z = np.subtract(other.pose.position, one.pose.position)
    assert math.sqrt(x * x + y * y + z * z) == pytest.approx(0.075, abs=0.001)
    assert y / x == pytest.approx(1.0 / 3.0, abs=1e-6)
    assert (other.piece.x_m, other.piece.y_m) == other.pose.position[:2]
    assert other.pose.position[2] == pytest.approx(0.05, abs=0.0005)
    world.restore([(body.piece, body.pose) for body in (one, other)])
    assert np.allclose(world.positions(), [one.pose.position, other.pose.position])
    world.close()


def test_scenes_hold_clear_pairs_of_every_preposition() -> None:
    configuration = SimulationConfiguration(arrangement="relations", shadows=False, textures=False)
    engine = SimulationEngine(configuration)
    found: Counter[Position | Distance] = Counter()
    for index in range(14):
        scene = engine.scene(4, index)
        stable = {label.name: label.stable for label in scene.object_labels}
        relations = {(one.object, one.reference): one for one in scene.relations}
        (first, lower), *contained = scene.supports
        stack = relations.get((first, lower)) or relations[lower, first]
        assert stack.position in (Position.ABOVE, Position.BELOW)
        for content, container in contained:
            inside = relations[content, container]
            assert inside.position is Position.IN
            assert not inside.position_ambiguous
            assert stable[content] is Truth.TRUE
            members = sorted((content, container))
            assert members in [label.members for label in scene.structure_labels]
        if not contained:
            names = sorted(known.name for known in scene.objects[2:4])
            assert relations[names[0], names[1]].distance is Distance.TOUCHING
        for one in scene.relations:
            found.update([one.position] * (not one.position_ambiguous))
            found.update([one.distance] * (not one.distance_ambiguous))
    engine.close()
    assert set(found) == {*Position, *Distance}
