"""The camera's memory: which scenes of a session were shown, settled or lost."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ros_scenesense.stages.health import Health
from ros_scenesense.stages.state_file import open_state_file

SceneState = Literal["open", "settled", "lost"]

_SCHEMA = """
CREATE TABLE scene (
    session TEXT NOT NULL,
    number INTEGER NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('open', 'settled', 'lost')),
    PRIMARY KEY (session, number)
) WITHOUT ROWID;
"""


class SceneLedger:
    """Keeps scene numbers from being used twice, also over restarts of the camera.

    Args:
        path: SQLite file, or `state_file.IN_MEMORY`.
        health: Takes the report of a damaged file.

    Raises:
        StateError: If the file cannot be used.
    """

    def __init__(self, path: Path, health: Health) -> None:
        self._connection = open_state_file(path, _SCHEMA, version=1, health=health)

    def record(self, session: str, number: int, state: SceneState) -> None:
        """Writes the state of a scene."""
        with self._connection:
            self._connection.execute(
                "INSERT INTO scene VALUES (?, ?, ?) "
                "ON CONFLICT (session, number) DO UPDATE SET state = excluded.state",
                (session, number, state),
            )

    def open_scenes(self, session: str) -> list[int]:
        """Numbers of the scenes that were begun but neither settled nor lost."""
        rows = self._connection.execute(
            "SELECT number FROM scene WHERE session = ? AND state = 'open' ORDER BY number",
            (session,),
        )
        return [number for (number,) in rows]

    def next_number(self, session: str) -> int:
        """The first number that the session has not used."""
        row = self._connection.execute(
            "SELECT max(number) FROM scene WHERE session = ?", (session,)
        ).fetchone()
        return 0 if row[0] is None else row[0] + 1

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()
