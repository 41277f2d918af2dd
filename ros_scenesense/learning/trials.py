"""What is learned about actions: attempts at one, with the state before it and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

from ros_scenesense.learning.examples import Fact, SceneState


@dataclass(frozen=True)
class Trial:
    """An action that was asked for.

    Attributes:
        id: Its id.
        scene_id: The scene in which it was asked for; trials of one scene belong together.
        action: Its name.
        arguments: Objects by their numbers in the state.
        state: What held before of its arguments.
        executed: False if the world refused it.
        failed: Whether it was refused, or did not bring about what it should.
        expected: What should have held after it.
        after: What was seen to hold.
    """

    id: str
    scene_id: str
    action: str
    arguments: tuple[str | int, ...]
    state: SceneState
    executed: bool
    failed: bool
    expected: frozenset[Fact]
    after: frozenset[Fact]
