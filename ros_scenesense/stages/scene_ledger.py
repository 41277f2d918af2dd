"""The camera's memory: what became of the scenes of a session, and of the actions in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from ros_scenesense.messages.actions import ActionResult, PlannedAction
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.state_file import open_state_file

SceneState = Literal["open", "settled", "lost"]

VERSION = 2
_SCENES = """
CREATE TABLE scene (
    session TEXT NOT NULL,
    number INTEGER NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('open', 'settled', 'lost')),
    PRIMARY KEY (session, number)
) WITHOUT ROWID;
"""
_ACTIONS = """
CREATE TABLE answer (
    scene_id TEXT NOT NULL,
    action_id TEXT NOT NULL,
    result TEXT NOT NULL,
    PRIMARY KEY (scene_id, action_id)
) WITHOUT ROWID;
CREATE TABLE step (
    session TEXT NOT NULL,
    number INTEGER NOT NULL,
    before INTEGER NOT NULL,
    episode_id TEXT NOT NULL,
    count INTEGER NOT NULL,
    action TEXT NOT NULL,
    PRIMARY KEY (session, number)
) WITHOUT ROWID;
"""


@dataclass(frozen=True)
class EpisodeStep:
    """How a scene of an episode came about.

    Attributes:
        before: Number of the scene that the robot acted in.
        episode_id: Of the episode.
        count: Actions done in the episode, this one included.
        action: What the robot did.
    """

    before: int
    episode_id: str
    count: int
    action: PlannedAction


class SceneLedger:
    """Keeps scene numbers and actions from being used twice, also over restarts of the camera.

    Args:
        path: SQLite file, or `state_file.IN_MEMORY`.
        health: Takes the report of a damaged file.

    Raises:
        StateError: If the file cannot be used.
    """

    def __init__(self, path: Path, health: Health) -> None:
        self._connection = open_state_file(
            path, _SCENES + _ACTIONS, VERSION, health, migrations=[_ACTIONS]
        )

    def record(self, session: str, number: int, state: SceneState) -> None:
        """Writes the state of a scene."""
        with self._connection:
            self._record(session, number, state)

    def open_scenes(self, session: str) -> list[int]:
        """Numbers of the scenes that were begun but neither settled nor lost."""
        rows = self._connection.execute(
            "SELECT number FROM scene WHERE session = ? AND state = 'open' ORDER BY number",
            (session,),
        )
        return [number for (number,) in rows]

    def lost_scenes(self, session: str, newest: int) -> list[int]:
        """Numbers of the newest scenes that were lost, in order."""
        rows = self._connection.execute(
            "SELECT number FROM scene WHERE session = ? AND state = 'lost' "
            "ORDER BY number DESC LIMIT ?",
            (session, newest),
        )
        return sorted(number for (number,) in rows)

    def give_up_others(self, session: str) -> list[tuple[str, int]]:
        """Writes that the open scenes of all other sessions are lost; their sessions and numbers.

        A camera that starts a new session does not come back to those of before.
        """
        with self._connection:
            rows = self._connection.execute(
                "UPDATE scene SET state = 'lost' WHERE state = 'open' AND session <> ? "
                "RETURNING session, number",
                (session,),
            ).fetchall()
        return sorted((other, number) for other, number in rows)

    def next_number(self, session: str) -> int:
        """The first number that the session has not used."""
        row = self._connection.execute(
            "SELECT max(number) FROM scene WHERE session = ?", (session,)
        ).fetchone()
        return 0 if row[0] is None else row[0] + 1

    def answer(self, scene_id: str, action_id: str) -> ActionResult | None:
        """What was answered to an action; None if it is new."""
        row = self._connection.execute(
            "SELECT result FROM answer WHERE scene_id = ? AND action_id = ?", (scene_id, action_id)
        ).fetchone()
        return None if row is None else decode(row[0], ActionResult)

    def record_refusal(self, result: ActionResult) -> None:
        """Writes the answer to an action that was not executed."""
        with self._connection:
            self._answer(result)

    def record_step(
        self, result: ActionResult, session: str, number: int, step: EpisodeStep
    ) -> None:
        """Writes the answer to an executed action together with the open scene of its effect."""
        action = msgspec.json.encode(step.action).decode()
        with self._connection:
            self._answer(result)
            self._record(session, number, "open")
            self._connection.execute(
                "INSERT INTO step VALUES (?, ?, ?, ?, ?, ?)",
                (session, number, step.before, step.episode_id, step.count, action),
            )

    def step(self, session: str, number: int) -> EpisodeStep | None:
        """How a scene came about; None for the scenes that the camera shows by itself."""
        row = self._connection.execute(
            "SELECT before, episode_id, count, action FROM step WHERE session = ? AND number = ?",
            (session, number),
        ).fetchone()
        if row is None:
            return None
        before, episode_id, count, action = row
        return EpisodeStep(
            before, episode_id, count, msgspec.json.decode(action, type=PlannedAction)
        )

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()

    def _record(self, session: str, number: int, state: SceneState) -> None:
        self._connection.execute(
            "INSERT INTO scene VALUES (?, ?, ?) "
            "ON CONFLICT (session, number) DO UPDATE SET state = excluded.state",
            (session, number, state),
        )

    def _answer(self, result: ActionResult) -> None:
        self._connection.execute(
            "INSERT INTO answer VALUES (?, ?, ?)",
            (result.scene_id, result.id, encode(result).decode()),
        )
