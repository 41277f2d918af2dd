"""The reasoner's memory of goals: the open one, and what was done and seen for it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ros_scenesense.messages.actions import Action, Transition
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.state_file import open_state_file

VERSION = 1
_SCHEMA = """
CREATE TABLE goal (
    id TEXT PRIMARY KEY,
    text TEXT NOT NULL,
    stamp_ns INTEGER NOT NULL,
    plans INTEGER NOT NULL DEFAULT 0,
    asked INTEGER NOT NULL DEFAULT 0,
    pending TEXT,
    observing INTEGER NOT NULL DEFAULT 0,
    outcome TEXT
) WITHOUT ROWID;
CREATE TABLE step (
    goal TEXT NOT NULL,
    number INTEGER NOT NULL,
    transition TEXT NOT NULL,
    diagnosis TEXT NOT NULL,
    PRIMARY KEY (goal, number)
) WITHOUT ROWID;
"""


@dataclass
class OpenGoal:
    """A goal that is being pursued.

    Attributes:
        id: Its id; also that of the episode.
        text: What is to hold.
        stamp: When somebody wanted it.
        plans: Plans that were made for it.
        asked: Actions that were asked for.
        pending: The action that is under way; None if there is none.
        observing: Whether that action was executed, and its effect is waited for.
    """

    id: str
    text: str
    stamp: Stamp
    plans: int = 0
    asked: int = 0
    pending: Action | None = None
    observing: bool = False


class GoalLedger:
    """Keeps the open goal over restarts of the reasoner, and the history of all goals.

    Args:
        path: SQLite file, or `state_file.IN_MEMORY`.
        health: Takes the report of a damaged file.

    Raises:
        StateError: If the file cannot be used.
    """

    def __init__(self, path: Path, health: Health) -> None:
        self._connection = open_state_file(path, _SCHEMA, VERSION, health)

    def open_goal(self) -> OpenGoal | None:
        """The goal that nobody has closed; None if there is none."""
        row = self._connection.execute(
            "SELECT id, text, stamp_ns, plans, asked, pending, observing FROM goal "
            "WHERE outcome IS NULL ORDER BY stamp_ns DESC"
        ).fetchone()
        if row is None:
            return None
        identifier, text, stamp_ns, plans, asked, pending, observing = row
        action = None if pending is None else decode(pending, Action)
        return OpenGoal(identifier, text, Stamp.of(stamp_ns), plans, asked, action, bool(observing))

    def knows(self, identifier: str) -> bool:
        """Whether a goal of this id was taken before."""
        row = self._connection.execute("SELECT 1 FROM goal WHERE id = ?", (identifier,)).fetchone()
        return row is not None

    def keep(self, goal: OpenGoal) -> None:
        """Writes how far a goal has come."""
        pending = None if goal.pending is None else encode(goal.pending).decode()
        with self._connection:
            self._connection.execute(
                "INSERT INTO goal (id, text, stamp_ns, plans, asked, pending, observing) "
                "VALUES (?, ?, ?, ?, ?, ?, ?) ON CONFLICT (id) DO UPDATE SET "
                "plans = excluded.plans, asked = excluded.asked, pending = excluded.pending, "
                "observing = excluded.observing",
                (
                    goal.id,
                    goal.text,
                    goal.stamp.nanoseconds,
                    goal.plans,
                    goal.asked,
                    pending,
                    goal.observing,
                ),
            )

    def close_goal(self, identifier: str, outcome: str) -> None:
        """Writes what became of a goal."""
        with self._connection:
            self._connection.execute(
                "UPDATE goal SET outcome = ?, pending = NULL WHERE id = ?", (outcome, identifier)
            )

    def record(self, goal: str, transition: Transition, diagnosis: str) -> None:
        """Writes what an action of a goal has led to, and how that was explained."""
        with self._connection:
            self._connection.execute(
                "INSERT OR REPLACE INTO step VALUES (?, ?, ?, ?)",
                (goal, transition.step, encode(transition).decode(), diagnosis),
            )

    def history(self, goal: str) -> list[tuple[Transition, str]]:
        """What was done for a goal: transitions with the explanation of what was unexpected."""
        rows = self._connection.execute(
            "SELECT transition, diagnosis FROM step WHERE goal = ? ORDER BY number", (goal,)
        )
        return [(decode(transition, Transition), diagnosis) for transition, diagnosis in rows]

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()
