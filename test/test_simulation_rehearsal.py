"""Plans tried out in real physics, from the beginning of a scene again and again."""

from collections.abc import Iterator

import pytest

from ros_scenesense.errors import SimulationError
from ros_scenesense.messages.actions import PlannedAction
from ros_scenesense.resources import resource
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.configuration import SimulationConfiguration
from ros_scenesense.simulation.rehearsal import Rehearsal
from ros_scenesense.simulation.scene_files import read_scenes

BOX, CUBE, DUCK = "red_cracker_box", "white_cube", "yellow_duck"
(FILE,) = read_scenes(resource("config", "scenes/planning.yaml"))


def moves(*pairs: tuple[str, str]) -> list[PlannedAction]:
    """Takes one object after the other and puts it somewhere."""
    return [
        action
        for name, where in pairs
        for action in (
            PlannedAction(kind="pickup", object=name),
            PlannedAction(kind="putdown", object=name, location=where),
        )
    ]


@pytest.fixture(scope="module")
def rehearsal() -> Iterator[Rehearsal]:
    engine = Rehearsal(SimulationConfiguration(width=160, height=120, shadows=False))
    with pytest.raises(SimulationError, match="no scene to try plans in"):
        engine.attempt([])
    engine.written(FILE)
    yield engine
    engine.close()


def test_before_any_action_the_scene_is_as_it_was_built(rehearsal):
    tried = rehearsal.attempt([], looks=True)
    assert (tried.failure, tried.supports, tried.in_hand) == ("", (), None)
    assert tried.occluded[BOX] is Truth.TRUE
    assert tried.occluded[CUBE] is tried.occluded[DUCK] is Truth.FALSE


def test_a_plan_leads_to_what_stands_on_what_and_what_is_seen(rehearsal):
    tried = rehearsal.attempt(moves((BOX, CUBE)), looks=True)
    assert (tried.failure, tried.supports) == ("", ((BOX, CUBE),))
    assert tried.occluded[BOX] is Truth.FALSE
    (first, _) = moves((BOX, CUBE))
    assert rehearsal.attempt([first]).in_hand == BOX
    # Nobody was asked to look, and the scene has not changed for the next plan.
    assert rehearsal.attempt([first]).occluded == {}
    assert rehearsal.attempt([]).supports == ()


def test_a_plan_ends_where_something_falls(rehearsal):
    tried = rehearsal.attempt(moves((CUBE, DUCK), (BOX, CUBE)), looks=True)
    assert tried.failure.startswith("step 1")
    # The state is that before the failure.
    assert (tried.supports, tried.in_hand, tried.occluded) == ((), CUBE, {})


def test_a_plan_ends_where_an_action_is_refused(rehearsal):
    tried = rehearsal.attempt(moves((BOX, CUBE), (CUBE, "table")))
    assert tried.failure.startswith("step 2")
    assert tried.failure.endswith(f"{BOX} stands on {CUBE}")
    assert tried.supports == ((BOX, CUBE),)


def test_the_same_plan_leads_to_the_same_state_in_another_engine(rehearsal):
    plan = moves((BOX, CUBE), (DUCK, "table"))
    other = Rehearsal(SimulationConfiguration(width=160, height=120, shadows=False))
    try:
        other.written(FILE)
        other.attempt(moves((DUCK, CUBE)))
        for careful in (True, False):
            one, two = (each.attempt(plan, True, careful) for each in (rehearsal, other))
            assert one == two
    finally:
        other.close()


def test_a_careful_hand_puts_things_nearer_to_the_middle(rehearsal):
    def offset(careful: bool) -> float:
        state = rehearsal._after(tuple(moves((BOX, CUBE))), careful)
        places = {piece.name: pose.position for piece, pose in state.bodies}
        away = [a - b for a, b in zip(places[BOX], places[CUBE], strict=True)][:2]
        return (away[0] ** 2 + away[1] ** 2) ** 0.5

    assert offset(careful=True) < 0.0105
    assert offset(careful=True) != offset(careful=False) < 0.045
