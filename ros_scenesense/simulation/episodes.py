"""Scenes that robot actions have changed: the world after some actions, seen by the same camera.

An episode is told by the scene that it began in and the actions since; everything random in it is
drawn from these. So the same story always leads to the same world, in whatever process.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ros_scenesense.errors import SimulationError
from ros_scenesense.messages.actions import PlannedAction
from ros_scenesense.messages.scenes import StructureLabel
from ros_scenesense.scene import Truth, find_structures
from ros_scenesense.simulation.arrangements import Layout
from ros_scenesense.simulation.engine import (
    Draft,
    Shot,
    SimulatedScene,
    SimulationConfiguration,
    SimulationEngine,
)
from ros_scenesense.simulation.scene_files import SceneFile
from ros_scenesense.simulation.stability import stability, structure_stability
from ros_scenesense.simulation.wish import ANY, Wish

if TYPE_CHECKING:
    from ros_scenesense.simulation.actions import ActionOutcome, Manipulation


@dataclass(frozen=True)
class Story:
    """How a scene came about.

    Attributes:
        seed: Seed of the scene that the robot began in.
        index: Its number.
        actions: What the robot has done since.
    """

    seed: int
    index: int
    actions: tuple[PlannedAction, ...] = ()

    @property
    def in_hand(self) -> str | None:
        """What the robot holds."""
        last = self.actions[-1] if self.actions else None
        return last.object if last is not None and last.kind == "pickup" else None

    def then(self, action: PlannedAction) -> Story:
        """The story with one more action."""
        return replace(self, actions=(*self.actions, action))


class EpisodeEngine(SimulationEngine):
    """Makes simulated scenes in which a robot can act.

    Args:
        configuration: Parameters of all scenes.
        files: If there are any, these scenes are made instead of drawn ones, by their index.
    """

    def __init__(
        self, configuration: SimulationConfiguration, files: Sequence[SceneFile] = ()
    ) -> None:
        super().__init__(configuration)
        self._files = tuple(files)
        self._seen: tuple[Draft, Shot] | None = None
        # The newest story and its world, which stands until another scene is built.
        self._story: Story | None = None
        self._manipulation: Manipulation | None = None

    def scene(self, seed: int, index: int, wish: Wish = ANY) -> SimulatedScene:
        """Makes a scene that nobody has acted in; see `SimulationEngine.scene`."""
        self._story = None
        if self._files:
            return self.written(self._files[index])
        return super().scene(seed, index, wish)

    def act(
        self, story: Story, action: PlannedAction
    ) -> tuple[ActionOutcome, SimulatedScene | None]:
        """Executes one more action.

        Returns:
            What became of it, and the scene that shows the world afterwards; None if the action
            was refused.

        Raises:
            SimulationError: If an action of the story cannot be executed.
        """
        manipulation = self._world_after(story)
        outcome = _execute(manipulation, story, action)
        if not outcome.executed:
            return outcome, None
        self._story = story.then(action)
        return outcome, self._observe(manipulation, self._story)

    def replay(self, story: Story) -> SimulatedScene:
        """The scene that `act` returned for the last action of a story.

        Raises:
            SimulationError: If an action of the story cannot be executed.
        """
        manipulation = self._world_after(story)
        return self._observe(manipulation, story)

    def _scene(self, draft: Draft, shot: Shot, stable: dict[str, Truth]) -> SimulatedScene:
        self._seen = (draft, shot)
        return super()._scene(draft, shot, stable)

    def _world_after(self, story: Story) -> Manipulation:
        if self._story == story and self._manipulation is not None:
            return self._manipulation
        from ros_scenesense.simulation.actions import Manipulation, View

        begun = self.scene(story.seed, story.index)
        assert self._seen is not None
        view = View(self._seen[1].pose, self._intrinsics)
        manipulation = Manipulation(self._world, begun.supports, view)
        so_far = Story(story.seed, story.index)
        for action in story.actions:
            outcome = _execute(manipulation, so_far, action)
            if not outcome.executed:
                raise SimulationError(
                    f"step {len(so_far.actions)} of the episode in scene {story.index} of seed "
                    f"{story.seed} cannot be repeated: {outcome.reason}"
                )
            so_far = so_far.then(action)
        self._story, self._manipulation = story, manipulation
        return manipulation

    def _observe(self, manipulation: Manipulation, story: Story) -> SimulatedScene:
        """What the camera of the first scene sees now, with the truth about it."""
        from ros_scenesense.simulation import contacts

        assert self._seen is not None
        draft, shot = self._seen
        world = self._world
        names = [body.piece.name for body in world.bodies]
        # What leans on a neighbour is judged together with it, though it is another structure.
        stable = stability(
            world, find_structures(names, contacts.touching(world)), _rng(story, "jitter")
        )
        world.reset()
        picture = self._camera.picture(shot.pose, shot.light)
        layout = Layout(draft.layout.arrangement, tuple(body.piece for body in world.bodies))
        scene = self._scene(replace(draft, layout=layout), replace(shot, picture=picture), stable)
        # A layout knows one support for each object; what has fallen may lie on several.
        structures = [
            StructureLabel(members=list(members), stable=structure_stability(members, stable))
            for members in find_structures(names, manipulation.supports)
        ]
        return replace(scene, supports=list(manipulation.supports), structure_labels=structures)


def _execute(manipulation: Manipulation, story: Story, action: PlannedAction) -> ActionOutcome:
    if action.kind == "pickup":
        return manipulation.pickup(action.object)
    from ros_scenesense.simulation.actions import TABLE

    return manipulation.putdown(action.object, action.location or TABLE, _rng(story, "putdown"))


def _rng(story: Story, purpose: str) -> np.random.Generator:
    return np.random.default_rng([story.seed, story.index, len(story.actions), *purpose.encode()])
