"""What physics says: stability labels, surfaces, and who is hidden by whom."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from ros_scenesense.scene import Surface, Truth
from ros_scenesense.simulation.arrangements import Arrangement, Layout, Piece, draw_layout
from ros_scenesense.simulation.camera import Camera
from ros_scenesense.simulation.catalogue import CatalogueItem, load_catalogue
from ros_scenesense.simulation.object_files import Color
from ros_scenesense.simulation.occlusion import Visibility, occlusion, visibilities
from ros_scenesense.simulation.stability import (
    StandingTest,
    stability,
    structure_stability,
)
from ros_scenesense.simulation.statics import Statics
from ros_scenesense.simulation.view import draw_light, frame_scene, renderer_intrinsics
from ros_scenesense.simulation.world import World

CATALOGUE = load_catalogue()
SMALL_CUBE = CATALOGUE["small_cube"]
MEDIUM_CUBE = CATALOGUE["medium_cube"]
LARGE_CUBE = CATALOGUE["large_cube"]


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    world = World(CATALOGUE)
    yield world
    world.close()


def piece(
    item: CatalogueItem, color: Color, x: float = 0.0, y: float = 0.0, support: int | None = None
) -> Piece:
    return Piece(item, color, x, y, 0.0, support)


def labels(world: World, *structures: list[Piece], seed: int = 0) -> dict[str, Truth]:
    world.build([member for structure in structures for member in structure])
    names = [tuple(member.name for member in structure) for structure in structures]
    return stability(world, names, np.random.default_rng(seed))


@pytest.mark.parametrize("item", CATALOGUE.values(), ids=lambda item: item.name)
def test_surface_is_flat_iff_a_centred_cube_stays(world: World, item: CatalogueItem) -> None:
    stays = []
    for cube in (SMALL_CUBE, MEDIUM_CUBE, LARGE_CUBE):
        stack = [piece(item, Color.RED), piece(cube, Color.BLUE, support=0)]
        stable = labels(world, stack)["blue_cube"] is Truth.TRUE
        # What fell into a container stays there, but not on it.
        lower, upper = world.build(stack)
        on_top = upper.pose.position[2] > lower.pose.position[2] + item.height_m / 2.0
        stays.append(stable and on_top)
    assert all(stays) == (item.surface is Surface.FLAT)
    assert item.is_open or len(set(stays)) == 1


@pytest.mark.parametrize("item", CATALOGUE.values(), ids=lambda item: item.name)
def test_what_stands_alone_stays(world: World, item: CatalogueItem) -> None:
    assert labels(world, [piece(item, Color.RED)]) == {f"red_{item.shape}": Truth.TRUE}


def test_standing_is_tested_once_for_each_kind(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    standing = StandingTest(world)
    assert all(standing.stays(item) for item in CATALOGUE.values())
    monkeypatch.setattr(world, "step", None)
    assert standing.stays(SMALL_CUBE)
    assert world.bodies == []


def test_what_is_certain_of_a_stack_physics_confirms(world: World) -> None:
    """Few candidates would be worth while if nearly nothing were certain."""
    statics = Statics(CATALOGUE)
    verdicts = {True: 0, False: 0, None: 0}
    for index in range(90):
        rng = np.random.default_rng([11, index])
        layout = draw_layout(CATALOGUE, Arrangement.TOWERS, index, 0.0, rng)
        verdict = statics.stands(layout.pieces)
        verdicts[verdict] += 1
        if verdict is None:
            continue
        found = labels(world, list(layout.pieces))
        if verdict:
            assert Truth.FALSE not in found.values()
        else:
            assert set(found.values()) != {Truth.TRUE}
    assert min(verdicts[True], verdicts[False]) > 10


def test_statics_knows_edges_and_balls() -> None:
    statics = Statics(CATALOGUE)

    def two(lower: str, upper: str, y: float) -> bool | None:
        below = piece(CATALOGUE[lower], Color.RED)
        return statics.stands([below, piece(CATALOGUE[upper], Color.BLUE, y=y, support=0)])

    assert two("large_cube", "small_cube", 0.0) is True
    assert two("large_cube", "small_cube", 0.041) is True
    assert two("large_cube", "small_cube", 0.045) is None
    assert two("large_cube", "small_cube", 0.051) is False
    # A ball touches in a point, and a duck has no level face on its top.
    assert two("large_cube", "small_sphere", 0.0) is None
    assert two("large_duck", "small_cube", 0.0) is None


def test_an_overhang_falls_and_leaves_its_support(world: World) -> None:
    stack = [
        piece(LARGE_CUBE, Color.RED),
        piece(MEDIUM_CUBE, Color.BLUE, y=0.02, support=0),
        piece(SMALL_CUBE, Color.WHITE, y=0.02 + 0.045, support=1),
    ]
    assert labels(world, stack) == {
        "red_cube": Truth.TRUE,
        "blue_cube": Truth.TRUE,
        "white_cube": Truth.FALSE,
    }


def test_a_load_at_the_edge_is_ambiguous(world: World) -> None:
    stack = [piece(SMALL_CUBE, Color.RED), piece(SMALL_CUBE, Color.BLUE, y=0.0245, support=0)]
    found = {labels(world, stack, seed=seed)["blue_cube"] for seed in range(6)}
    assert Truth.AMBIGUOUS in found


def test_a_bystander_that_would_be_hit_keeps_its_own_label(world: World) -> None:
    stack = [
        piece(CATALOGUE["large_cylinder"], Color.RED),
        piece(LARGE_CUBE, Color.BLUE, y=0.07, support=0),
    ]
    bystander = piece(CATALOGUE["small_sphere"], Color.WHITE, y=0.16)
    assert labels(world, stack, [bystander])["white_sphere"] is Truth.TRUE
    # Judged as one structure it is hit: so standing apart is what protects it.
    assert labels(world, [*stack, bystander])["white_sphere"] is Truth.FALSE


@pytest.mark.parametrize(
    ("members", "expected"),
    [
        ([Truth.TRUE, Truth.TRUE], Truth.TRUE),
        ([Truth.TRUE, Truth.AMBIGUOUS], Truth.AMBIGUOUS),
        ([Truth.AMBIGUOUS, Truth.FALSE], Truth.FALSE),
        ([Truth.TRUE, Truth.FALSE], Truth.FALSE),
    ],
)
def test_structures_follow_their_members(members: list[Truth], expected: Truth) -> None:
    stable = {str(number): value for number, value in enumerate(members)}
    assert structure_stability(stable, stable) is expected


def test_bodies_touch_what_carries_them(world: World) -> None:
    duck = CATALOGUE["large_duck"]
    world.build([piece(duck, Color.RED), piece(MEDIUM_CUBE, Color.BLUE, support=0)])
    corners = world.corners().reshape(2, 8, 3)
    assert corners[0, :, 2].min() == pytest.approx(0.0, abs=0.0015)
    # The collision shapes' boxes are padded by up to a millimetre.
    assert corners[1, :, 2].min() == pytest.approx(duck.height_m, abs=0.004)


def seen(world: World, pieces: list[Piece], pitch_deg: float = 20.0) -> list[Visibility]:
    intrinsics = renderer_intrinsics(320, 240, 40.0)
    camera = Camera(world, intrinsics, shadows=False)
    world.build(pieces)
    pose = frame_scene(world.corners(), intrinsics, math.radians(pitch_deg), 0.0, 1.1)
    picture = camera.picture(pose, draw_light(np.random.default_rng(0)))
    layout = Layout(Arrangement.SPREAD, tuple(pieces))
    return visibilities(world, camera, pose, layout, picture)


def fractions(world: World, pieces: list[Piece], pitch_deg: float = 20.0) -> list[float | None]:
    return [one.fraction for one in seen(world, pieces, pitch_deg)]


def test_who_hides_whom(world: World) -> None:
    rear, *others = seen(
        world,
        [
            piece(LARGE_CUBE, Color.RED, x=0.2),
            piece(MEDIUM_CUBE, Color.BLUE, y=0.04),
            piece(SMALL_CUBE, Color.GREEN, y=-0.04),
            piece(SMALL_CUBE, Color.WHITE, x=-0.05, y=0.12),
        ],
        pitch_deg=5.0,
    )
    assert [(one.object, one.by) for one in rear.hidden] == [
        ("red_cube", "blue_cube"),
        ("red_cube", "green_cube"),
    ]
    assert rear.hidden[0].share > rear.hidden[1].share > 0.05
    assert sum(one.share for one in rear.hidden) == pytest.approx(1.0 - rear.fraction)
    assert all(not other.hidden for other in others)


def test_a_load_does_not_hide_but_what_stands_before_both_does(world: World) -> None:
    pieces = [
        piece(MEDIUM_CUBE, Color.RED, x=0.2),
        piece(MEDIUM_CUBE, Color.BLUE, x=0.2, support=0),
        piece(LARGE_CUBE, Color.WHITE),
    ]
    below, above, _ = seen(world, pieces, pitch_deg=10.0)
    assert {one.by for one in below.hidden} == {"white_cube"}
    assert {one.by for one in above.hidden} <= {"white_cube"}


def test_what_stands_in_front_hides(world: World) -> None:
    rear, front, aside = fractions(
        world,
        [
            piece(SMALL_CUBE, Color.RED, x=0.12),
            piece(LARGE_CUBE, Color.BLUE),
            piece(MEDIUM_CUBE, Color.WHITE, y=0.2),
        ],
    )
    assert rear < 0.3
    assert front == pytest.approx(1.0, abs=0.01)
    assert aside == pytest.approx(1.0, abs=0.01)


def test_half_of_an_object_is_half_visible(world: World) -> None:
    # Nearly level, from nearly straight ahead: the left half of the rear cube shows.
    rear, _ = fractions(
        world,
        [piece(LARGE_CUBE, Color.RED, x=0.105), piece(LARGE_CUBE, Color.BLUE, y=-0.05)],
        pitch_deg=5.0,
    )
    assert 0.4 < rear < 0.65


def test_a_load_does_not_occlude_its_support(world: World) -> None:
    below, above = fractions(
        world, [piece(MEDIUM_CUBE, Color.RED), piece(MEDIUM_CUBE, Color.BLUE, support=0)], 30.0
    )
    assert below >= 0.97
    assert above >= 0.97


@pytest.mark.parametrize(
    ("fraction", "expected"),
    [
        (0.0, Truth.TRUE),
        (0.899, Truth.TRUE),
        (0.90, Truth.AMBIGUOUS),
        (0.969, Truth.AMBIGUOUS),
        (0.97, Truth.FALSE),
        (1.0, Truth.FALSE),
    ],
)
def test_occlusion_has_an_ambiguous_band(fraction: float, expected: Truth) -> None:
    assert occlusion(fraction) is expected
