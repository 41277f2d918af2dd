"""Whole plans tried out in the physics of one scene, from its beginning again and again.

An `EpisodeEngine` shows the world to the robot after every action. Here nobody looks on: only what
stands on what is asked after each action, and at the end what is occluded. Plans that begin alike
share what they have in common.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Pose
from ros_scenesense.messages.actions import PlannedAction
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.arrangements import Layout, Piece
from ros_scenesense.simulation.engine import Draft, SimulatedScene, SimulationConfiguration
from ros_scenesense.simulation.episodes import EpisodeEngine
from ros_scenesense.simulation.occlusion import occlusion, visibilities
from ros_scenesense.simulation.scene_files import SceneFile
from ros_scenesense.simulation.wish import ANY, Wish

CAREFUL_M = 0.01
"""So near to the middle of its support a careful hand puts an object."""


@dataclass(frozen=True)
class Tried:
    """What became of a plan.

    Attributes:
        failure: Which action was refused, or what fell; empty if all went as it should. What
            follows is the state after the last action that did.
        supports: Pairs (upper, lower) of names.
        in_hand: Name of what the hand holds.
        occluded: By name; empty unless it was asked.
    """

    failure: str
    supports: tuple[tuple[str, str], ...]
    in_hand: str | None
    occluded: dict[str, Truth]


@dataclass(frozen=True)
class _State:
    """A state of the world between two actions; `failure` as in `Tried`."""

    bodies: tuple[tuple[Piece, Pose], ...]
    supports: tuple[tuple[str, str], ...]
    held: Piece | None = None
    failure: str = ""


class Rehearsal(EpisodeEngine):
    """Tries plans in one scene after the other.

    The camera stands back, so that it sees what is put on the table beside everything else.

    Args:
        configuration: Parameters of all scenes.
    """

    def __init__(self, configuration: SimulationConfiguration) -> None:
        super().__init__(configuration)
        self._origin: tuple[int, int] = (0, 0)
        self._begun: _State | None = None
        self._states: dict[tuple[bool, tuple[PlannedAction, ...]], _State] = {}

    def scene(self, seed: int, index: int, wish: Wish = ANY) -> SimulatedScene:
        """Makes the scene in which plans are tried from now on; see `SimulationEngine.scene`."""
        scene = super().scene(seed, index, wish)
        self._origin = (seed, index)
        self._begin(scene)
        return scene

    def written(self, file: SceneFile) -> SimulatedScene:
        """Makes the scene of a file, in which plans are tried from now on."""
        scene = super().written(file)
        self._origin = (0, 0)
        self._begin(scene)
        return scene

    def attempt(
        self, actions: Sequence[PlannedAction], looks: bool = False, careful: bool = True
    ) -> Tried:
        """Executes a plan from the beginning of the scene.

        It ends early if an action is refused, if what is put down does not stay where it was put,
        or if anything else moves by more than 2 cm.

        Args:
            actions: The plan.
            looks: Whether to find out what is occluded afterwards.
            careful: Whether a careful hand does it, or one that is no more exact than the world
                is built.

        Raises:
            SimulationError: If there is no scene.
        """
        state = self._after(tuple(actions), careful)
        occluded = self._occluded(state) if looks and not state.failure else {}
        held = None if state.held is None else state.held.name
        return Tried(state.failure, state.supports, held, occluded)

    def _framed(self, draft: Draft, pitch_deg: float, distance: float, roll_deg: float) -> Pose:
        return super()._framed(draft, pitch_deg, max(distance, _DISTANCE), roll_deg)

    def _begin(self, scene: SimulatedScene) -> None:
        bodies = tuple((body.piece, body.pose) for body in self._world.bodies)
        self._begun = _State(bodies, tuple(scene.supports))
        self._states = {}

    def _after(self, actions: tuple[PlannedAction, ...], careful: bool) -> _State:
        if self._begun is None:
            raise SimulationError("there is no scene to try plans in: make one first")
        if not actions:
            return self._begun
        known = self._states.get((careful, actions))
        if known is None:
            before = self._after(actions[:-1], careful)
            known = before if before.failure else self._done(before, actions, careful)
            self._states[careful, actions] = known
        return known

    def _done(self, before: _State, actions: tuple[PlannedAction, ...], careful: bool) -> _State:
        """The state after the last of the actions."""
        from ros_scenesense.simulation.actions import TABLE, Manipulation, View

        assert self._seen is not None
        self._world.restore(before.bodies)
        view = View(self._seen[1].pose, self._intrinsics)
        error_m = CAREFUL_M if careful else None
        hand = Manipulation(self._world, before.supports, view, error_m)
        hand.held = before.held
        action = actions[-1]
        where = action.location or TABLE
        if action.kind == "pickup":
            outcome, is_there = hand.pickup(action.object), True
        else:
            story = [*self._origin, *" ".join(map(str, actions)).encode()]
            outcome = hand.putdown(action.object, where, np.random.default_rng(story))
            is_there = outcome.settled_on == where
        if outcome.executed and is_there and not outcome.moved:
            bodies = tuple((body.piece, body.pose) for body in self._world.bodies)
            return _State(bodies, tuple(hand.supports), hand.held)
        words = outcome.reason or f"it is on {outcome.settled_on}, moved: {outcome.moved}"
        return replace(before, failure=f"step {len(actions) - 1}, {action}: {words}")

    def _occluded(self, state: _State) -> dict[str, Truth]:
        assert self._seen is not None
        draft, shot = self._seen
        self._world.restore(state.bodies)
        picture = self._camera.picture(shot.pose, shot.light)
        pieces = tuple(piece for piece, _ in state.bodies)
        layout = Layout(draft.layout.arrangement, pieces)
        seen = visibilities(self._world, self._camera, shot.pose, layout, picture)
        return {
            piece.name: occlusion(one.fraction) for piece, one in zip(pieces, seen, strict=True)
        }


# So many times as far from everything as it must be.
_DISTANCE = 2.0
