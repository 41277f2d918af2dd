"""What learner.db remembers of attempts at actions; each is applied once."""

from __future__ import annotations

import sqlite3

import msgspec

from ros_scenesense.learning.examples import Fact, SceneState
from ros_scenesense.learning.trials import Trial

TRIAL_SCHEMA = """
CREATE TABLE trial (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    content TEXT
);
"""
_KEPT = 300
_KNOWN = 10_000
"""So many actions are recognised when they come again, long after their content is forgotten."""


class TrialStore:
    """Attempts at actions, the newest ones.

    Args:
        connection: To a file that has `TRIAL_SCHEMA`.
    """

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def knows(self, identifier: str) -> bool:
        """Whether what came of an action was taken before."""
        row = self._connection.execute("SELECT 1 FROM trial WHERE id = ?", (identifier,)).fetchone()
        return row is not None

    def add(self, identifier: str, trial: Trial | None) -> None:
        """Keeps an attempt; or only that it is known, where nothing is to be learned from it.

        Args:
            identifier: Of the action; it must be new.
            trial: The attempt.
        """
        content = None if trial is None else msgspec.json.encode(_Content.of(trial)).decode()
        with self._connection:
            number = self._connection.execute(
                "INSERT INTO trial (id, content) VALUES (?, ?)", (identifier, content)
            ).lastrowid
            assert number is not None
            self._connection.execute(
                "UPDATE trial SET content = NULL WHERE number <= ? AND content IS NOT NULL",
                (number - _KEPT,),
            )
            self._connection.execute("DELETE FROM trial WHERE number <= ?", (number - _KNOWN,))

    def all(self) -> list[Trial]:
        """The attempts, oldest first."""
        rows = self._connection.execute(
            "SELECT content FROM trial WHERE content IS NOT NULL ORDER BY number"
        )
        return [msgspec.json.decode(content, type=_Content).trial() for (content,) in rows]


class _Content(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An attempt as it is written down."""

    id: str
    scene_id: str
    action: str
    arguments: tuple[str | int, ...]
    names: tuple[str, ...]
    before: list[Fact]
    executed: bool
    failed: bool
    expected: list[Fact]
    after: list[Fact]

    @classmethod
    def of(cls, trial: Trial) -> _Content:
        return cls(
            id=trial.id,
            scene_id=trial.scene_id,
            action=trial.action,
            arguments=trial.arguments,
            names=trial.state.names,
            before=sorted(trial.state.facts, key=repr),
            executed=trial.executed,
            failed=trial.failed,
            expected=sorted(trial.expected, key=repr),
            after=sorted(trial.after, key=repr),
        )

    def trial(self) -> Trial:
        return Trial(
            id=self.id,
            scene_id=self.scene_id,
            action=self.action,
            arguments=self.arguments,
            state=SceneState(self.names, frozenset(self.before)),
            executed=self.executed,
            failed=self.failed,
            expected=frozenset(self.expected),
            after=frozenset(self.after),
        )
