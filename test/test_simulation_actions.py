"""The hand in real physics: what it does, what it refuses, and that it does it twice alike."""

from collections.abc import Iterator

import numpy as np
import pytest

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import look_at
from ros_scenesense.messages.actions import PlannedAction
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.actions import TABLE, ActionOutcome, Manipulation, View
from ros_scenesense.simulation.arrangements import Piece
from ros_scenesense.simulation.catalogue import load_catalogue
from ros_scenesense.simulation.contacts import bottom_up, supports, touching
from ros_scenesense.simulation.engine import SimulationConfiguration
from ros_scenesense.simulation.episodes import EpisodeEngine, Story
from ros_scenesense.simulation.object_files import Color
from ros_scenesense.simulation.view import renderer_intrinsics
from ros_scenesense.simulation.world import World

CATALOGUE = load_catalogue()
SMALL_CUBE = CATALOGUE["small_cube"]
LARGE_CUBE = CATALOGUE["large_cube"]
LARGE_DUCK = CATALOGUE["large_duck"]
VIEW = View(look_at((-1.2, 0.0, 0.6), (0.0, 0.0, 0.05)), renderer_intrinsics(320, 240, 40.0))
NARROW = View(look_at((-0.15, 0.0, 0.15), (0.0, 0.0, 0.05)), renderer_intrinsics(320, 240, 40.0))


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    world = World(CATALOGUE)
    yield world
    world.close()


def hand_at(world: World, view: View = VIEW) -> Manipulation:
    """A hand before a blue on a red cube, a white cube and a yellow duck."""
    world.build(
        [
            Piece(LARGE_CUBE, Color.RED, 0.0, 0.0, 0.0),
            Piece(SMALL_CUBE, Color.BLUE, 0.0, 0.01, 0.5, support=0),
            Piece(LARGE_CUBE, Color.WHITE, 0.0, 0.2, 0.0),
            Piece(LARGE_DUCK, Color.YELLOW, 0.0, -0.2, 0.0),
        ]
    )
    return Manipulation(world, supports(world), view)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def names(world: World) -> set[str]:
    return {body.piece.name for body in world.bodies}


def position(world: World, name: str) -> np.ndarray:
    numbers = [body.piece.name for body in world.bodies]
    return world.positions()[numbers.index(name)]


def test_contacts_tell_what_stands_on_what(world: World) -> None:
    hand_at(world)
    assert supports(world) == [("blue_cube", "red_cube")]
    assert touching(world) == [("red_cube", "blue_cube")]


def test_bottom_up_puts_supports_first_even_in_a_circle() -> None:
    assert bottom_up(["a", "b", "c"], [("a", "b"), ("b", "c")]) == ["c", "b", "a"]
    circle = [("a", "b"), ("b", "c"), ("c", "a")]
    assert sorted(bottom_up(["a", "b", "c"], circle)) == ["a", "b", "c"]


def test_picks_the_top_of_a_stack_and_leaves_the_rest(world: World) -> None:
    hand = hand_at(world)
    assert hand.pickup("blue_cube") == ActionOutcome(True)
    assert hand.held is not None
    assert hand.held.name == "blue_cube"
    assert names(world) == {"red_cube", "white_cube", "yellow_duck"}
    assert hand.supports == []


def test_puts_down_on_a_flat_object(world: World) -> None:
    hand = hand_at(world)
    hand.pickup("blue_cube")
    assert hand.putdown("blue_cube", "white_cube", rng()) == ActionOutcome(
        True, settled_on="white_cube"
    )
    assert hand.held is None
    assert hand.supports == [("blue_cube", "white_cube")]
    assert position(world, "blue_cube")[2] == pytest.approx(0.125, abs=0.001)


@pytest.mark.parametrize("seed", range(4))
def test_puts_down_on_the_table_in_view_and_clear_of_others(world: World, seed: int) -> None:
    hand = hand_at(world)
    hand.pickup("blue_cube")
    outcome = hand.putdown("blue_cube", TABLE, rng(seed))
    assert outcome == ActionOutcome(True, settled_on=TABLE)
    assert touching(world) == []
    corners = world.corners().reshape(-1, 8, 3)[
        [body.piece.name == "blue_cube" for body in world.bodies]
    ]
    assert VIEW.contains(VIEW.boxes(corners)).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_cube_falls_off_a_duck(world: World, seed: int) -> None:
    hand = hand_at(world)
    hand.pickup("blue_cube")
    outcome = hand.putdown("blue_cube", "yellow_duck", rng(seed))
    assert outcome.executed
    assert outcome.settled_on == TABLE


def test_what_is_hit_has_moved(world: World) -> None:
    world.build(
        [
            Piece(SMALL_CUBE, Color.RED, 0.0, 0.0, 0.0),
            Piece(LARGE_CUBE, Color.BLUE, 0.0, 0.04, 0.0, support=0),
            Piece(LARGE_CUBE, Color.WHITE, 0.0, 0.3, 0.0),
        ]
    )
    hand = Manipulation(world, supports(world), VIEW)
    # Time runs only while the robot acts: the overhang falls now.
    assert hand.pickup("white_cube").moved == ("blue_cube",)


# Objects picked up before, the action, and the reason for which it is refused.
REFUSED: list[tuple[list[str], tuple[str, str, str | None], str]] = [
    ([], ("pickup", "no_such", None), "no_such is not in the scene"),
    ([], ("pickup", "red_cube", None), "blue_cube stands on red_cube"),
    ([], ("putdown", "blue_cube", TABLE), "the hand is empty"),
    (["blue_cube"], ("pickup", "white_cube", None), "the hand holds blue_cube"),
    (["blue_cube"], ("putdown", "red_cube", TABLE), "the hand holds blue_cube, not red_cube"),
    (["blue_cube"], ("putdown", "blue_cube", "blue_cube"), "cannot be put on itself"),
    (["blue_cube"], ("putdown", "blue_cube", "no_such"), "no_such is not in the scene"),
    (["white_cube"], ("putdown", "white_cube", "red_cube"), "blue_cube stands on red_cube"),
]


@pytest.mark.parametrize(("picked", "action", "reason"), REFUSED)
def test_a_violated_precondition_is_told_and_changes_nothing(
    world: World, picked: list[str], action: tuple[str, str, str | None], reason: str
) -> None:
    hand = hand_at(world)
    for name in picked:
        hand.pickup(name)
    before, held = world.positions(), hand.held
    _, name, location = action
    outcome = hand.pickup(name) if location is None else hand.putdown(name, location, rng())
    assert not outcome.executed
    assert reason in outcome.reason
    assert np.array_equal(world.positions(), before)
    assert hand.held is held


def test_a_table_without_room_is_refused(world: World) -> None:
    hand = hand_at(world, NARROW)
    hand.pickup("white_cube")
    outcome = hand.putdown("white_cube", TABLE, rng())
    assert outcome == ActionOutcome(False, "the table has no room for white_cube")


@pytest.fixture(scope="module")
def engine() -> Iterator[EpisodeEngine]:
    engine = EpisodeEngine(SimulationConfiguration(arrangement="towers", width=160, height=120))
    yield engine
    engine.close()


def pickup(name: str) -> PlannedAction:
    return PlannedAction(kind="pickup", object=name)


def putdown(name: str, location: str) -> PlannedAction:
    return PlannedAction(kind="putdown", object=name, location=location)


def top_of(engine: EpisodeEngine, index: int) -> str:
    scene = engine.scene(5, index)
    lower = {low for _, low in scene.supports}
    return next(known.name for known in scene.objects if known.name not in lower)


def test_an_episode_shows_what_became_of_the_world(engine: EpisodeEngine) -> None:
    top = top_of(engine, 0)
    begun = engine.scene(5, 0)
    story = Story(5, 0)
    outcome, lifted = engine.act(story, pickup(top))
    assert outcome.executed
    assert lifted is not None
    assert {known.name for known in lifted.objects} == {o.name for o in begun.objects} - {top}
    assert lifted.frame.camera_pose == begun.frame.camera_pose
    story = story.then(pickup(top))
    outcome, placed = engine.act(story, putdown(top, TABLE))
    assert outcome.settled_on == TABLE
    assert placed is not None
    (label,) = (label for label in placed.object_labels if label.name == top)
    assert label.stable is Truth.TRUE
    assert [top] in [label.members for label in placed.structure_labels]
    for number, known in enumerate(placed.objects, 1):
        assert known.instance == number
        assert np.any(placed.frame.instances == number)


def test_a_refused_action_shows_nothing_and_leaves_the_story(engine: EpisodeEngine) -> None:
    top = top_of(engine, 1)
    outcome, scene = engine.act(Story(5, 1), putdown(top, TABLE))
    assert (outcome.executed, scene) == (False, None)
    assert engine.act(Story(5, 1), pickup(top))[0].executed


def test_the_same_story_gives_the_same_scene_in_another_engine(engine: EpisodeEngine) -> None:
    top = top_of(engine, 2)
    story = Story(5, 2)
    for action in (pickup(top), putdown(top, TABLE), pickup(top)):
        _, scene = engine.act(story, action)
        story = story.then(action)
    _, scene = engine.act(story, putdown(top, TABLE))
    story = story.then(putdown(top, TABLE))
    other = EpisodeEngine(SimulationConfiguration(arrangement="towers", width=160, height=120))
    again = other.replay(story)
    other.close()
    assert scene is not None
    for image in ("color", "depth", "instances"):
        assert np.array_equal(getattr(scene.frame, image), getattr(again.frame, image))
    assert scene.object_labels == again.object_labels
    assert [one.pose for one in scene.placed] == [one.pose for one in again.placed]


def test_a_story_that_cannot_have_happened_is_an_error(engine: EpisodeEngine) -> None:
    with pytest.raises(SimulationError, match="hand is empty"):
        engine.replay(Story(5, 0, (putdown("x", TABLE),)))
