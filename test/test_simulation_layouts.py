"""What is drawn before physics: the catalogue, the arrangements, the meshes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.errors import SimulationError
from ros_scenesense.scene import Surface, find_structures
from ros_scenesense.simulation import meshes
from ros_scenesense.simulation.arrangements import Arrangement, Layout, draw_layout
from ros_scenesense.simulation.catalogue import load_catalogue
from ros_scenesense.simulation.mesh_files import read_mesh

CATALOGUE = load_catalogue()
SINGLE = [Arrangement.TOWERS, Arrangement.SPREAD, Arrangement.INTERSECTION]


def draw(arrangement: Arrangement, seed: int, index: int = 0) -> Layout:
    yaw = (seed % 7 - 3) / 3
    return draw_layout(CATALOGUE, arrangement, index, yaw, np.random.default_rng(seed))


def stacks(layout: Layout) -> list[tuple[str, ...]]:
    return find_structures([piece.name for piece in layout.pieces], layout.supports())


@settings(deadline=None, max_examples=60)
@given(st.sampled_from(SINGLE), st.integers(0, 2**32))
def test_a_layout_is_what_the_paper_describes(arrangement: Arrangement, seed: int) -> None:
    layout = draw(arrangement, seed)
    colors = [piece.color for piece in layout.pieces]
    assert len(set(colors)) == len(colors)
    sizes = sorted((len(members) for members in stacks(layout)), reverse=True)
    if arrangement is Arrangement.TOWERS:
        assert len(sizes) == 1
        assert 2 <= sizes[0] <= 5
    elif arrangement is Arrangement.SPREAD:
        assert sizes == [1, 1, 1, 1, 1]
    else:
        assert 2 <= sizes[0] <= 4
        assert 1 <= len(sizes) - 1 <= 3
        assert set(sizes[1:]) == {1}
        assert sum(sizes) <= 5


@settings(deadline=None, max_examples=60)
@given(st.sampled_from(SINGLE), st.integers(0, 2**32))
def test_objects_overlap_what_carries_them_and_nothing_else(
    arrangement: Arrangement, seed: int
) -> None:
    layout = draw(arrangement, seed)
    number = {name: i for i, members in enumerate(stacks(layout)) for name in members}
    for index, piece in enumerate(layout.pieces):
        if piece.support is not None:
            assert piece.support < index
            below = layout.pieces[piece.support]
            offset = math.hypot(piece.x_m - below.x_m, piece.y_m - below.y_m)
            assert offset <= 0.043 + 1e-9
            assert offset < (piece.item.width_m + below.item.width_m) / 2.0
        for other in layout.pieces[:index]:
            if number[other.name] != number[piece.name]:
                distance = math.hypot(piece.x_m - other.x_m, piece.y_m - other.y_m)
                assert distance - piece.item.radius_m - other.item.radius_m >= 0.02 - 1e-9


def test_mixed_takes_the_arrangements_in_turn() -> None:
    drawn = [draw(Arrangement.MIXED, 5, index).arrangement for index in range(6)]
    assert drawn == SINGLE * 2


def test_every_shape_size_and_height_is_drawn() -> None:
    layouts = [draw(arrangement, seed) for arrangement in SINGLE for seed in range(60)]
    assert {piece.item for layout in layouts for piece in layout.pieces} == {
        item for item in CATALOGUE.values() if not item.relations_only
    }
    assert {len(members) for layout in layouts for members in stacks(layout)} == {1, 2, 3, 4, 5}
    carried = {
        layout.pieces[piece.support].item.surface
        for layout in layouts
        for piece in layout.pieces
        if piece.support is not None
    }
    assert carried == {Surface.FLAT, Surface.IRREGULAR}


def volume(mesh: meshes.Mesh) -> float:
    corners = mesh.vertices[mesh.triangles]
    cross = np.cross(corners[:, 1], corners[:, 2])
    return float(np.einsum("ij,ij->", corners[:, 0], cross) / 6.0)


def test_round_meshes_are_closed_outward_and_true() -> None:
    ball = meshes.sphere(0.05)
    assert np.allclose(np.linalg.norm(ball.vertices, axis=1), 0.05)
    assert volume(ball) == pytest.approx(4.0 / 3.0 * math.pi * 0.05**3, rel=0.01)
    can = meshes.cylinder(0.04, 0.1)
    assert volume(can) == pytest.approx(math.pi * 0.04**2 * 0.1, rel=0.01)
    assert np.allclose(np.ptp(can.vertices, axis=0), [0.08, 0.08, 0.1], atol=1e-9)
    for mesh in (ball, can):
        assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)


@pytest.mark.parametrize("text", ["", "v 0 0 0\nf 1 2 3\n", "v a b c\nf 1 1 1\n", "f 1 2\n"])
def test_a_broken_mesh_file_is_named(tmp_path, text: str) -> None:
    path = tmp_path / "broken.obj"
    path.write_text(text)
    with pytest.raises(SimulationError, match=r"broken\.obj cannot be read"):
        read_mesh(path)
    with pytest.raises(SimulationError, match="missing"):
        read_mesh(tmp_path / "missing.obj")


def test_a_square_mesh_is_read_with_its_normals(tmp_path) -> None:
    path = tmp_path / "square.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1/1 3/1 4/1\n")
    square = read_mesh(path)
    assert square.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert np.allclose(square.normals, [0.0, 0.0, 1.0])
