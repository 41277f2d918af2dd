"""learner.db: labelled scenes, the axioms with their history, and what people said of them.

Every scene and every request is applied once, also after a restart; what a cycle has learned is
written in one transaction.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec

from ros_scenesense.learning.examples import Example, Fact, Reason, SceneState
from ros_scenesense.learning.strength import Strength
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.state_file import open_state_file, read_state_file
from ros_scenesense.stages.trial_store import TRIAL_SCHEMA, TrialStore

VERSION = 3
_MIGRATIONS = (
    TRIAL_SCHEMA,
    "ALTER TABLE event ADD COLUMN stamp_ns INTEGER NOT NULL DEFAULT 0;",
)
_SCHEMA = f"""
{TRIAL_SCHEMA}
CREATE TABLE scene (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    scene_id TEXT NOT NULL UNIQUE,
    state TEXT,
    learned INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE literal (
    scene INTEGER NOT NULL REFERENCES scene,
    fluent TEXT NOT NULL,
    target INTEGER NOT NULL,
    label INTEGER NOT NULL,
    reason TEXT NOT NULL,
    PRIMARY KEY (scene, fluent, target)
) WITHOUT ROWID;
CREATE TABLE axiom (
    id TEXT PRIMARY KEY,
    text TEXT NOT NULL,
    kind TEXT NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('active', 'forgotten', 'merged', 'vetoed')),
    decay REAL NOT NULL,
    idle INTEGER NOT NULL,
    support REAL NOT NULL,
    purity REAL NOT NULL,
    born INTEGER NOT NULL,
    pinned INTEGER NOT NULL DEFAULT 0,
    right INTEGER NOT NULL DEFAULT 0,
    wrong INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE event (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    cycle INTEGER NOT NULL,
    axiom TEXT NOT NULL,
    what TEXT NOT NULL,
    strength REAL NOT NULL,
    words TEXT NOT NULL,
    stamp_ns INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE refuted (axiom TEXT PRIMARY KEY, words TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE request (id TEXT PRIMARY KEY, outcome TEXT NOT NULL, reason TEXT NOT NULL)
    WITHOUT ROWID;
CREATE TABLE progress (cycle INTEGER NOT NULL, revision INTEGER NOT NULL);
INSERT INTO progress VALUES (0, 0);
"""
_SCENE_IDS = 10_000
"""So many scenes are recognised when they come again, long after their content is forgotten."""

AxiomState = Literal["active", "forgotten", "merged", "vetoed"]
Outcome = Literal["done", "refused"]


@dataclass(frozen=True)
class StoredAxiom:
    """A learned axiom.

    Attributes:
        id: Its id, never used again.
        text: Its statement in the action language.
        kind: normal or default.
        state: Only active ones are in force.
        strength: Its strength.
        support: Share of the examples that its body held of.
        purity: Share of those that it was true of.
        born: The cycle in which it was learned.
        pinned: Whether a person wants it never to be forgotten.
        right: Right decisions that it was used for since the last cycle.
        wrong: Wrong ones.
    """

    id: str
    text: str
    kind: Literal["normal", "default"]
    state: AxiomState
    strength: Strength
    support: float
    purity: float
    born: int
    pinned: bool = False
    right: int = 0
    wrong: int = 0


@dataclass(frozen=True)
class Event:
    """Something that became of an axiom, in the cycle in which it did; time 0 = nobody knows."""

    cycle: int
    axiom: str
    what: str
    strength: float
    words: str = ""
    stamp_ns: int = 0


@dataclass(frozen=True)
class Changes:
    """What a cycle or a request changes.

    Attributes:
        axioms: Axioms as they are now.
        events: What became of them.
        refuted: Given axioms that are out of force from now on, each with why.
        restored: Given axioms that are in force again.
        changed: Fluents of which older labels than the cycle's tell nothing any more.
    """

    axioms: Sequence[StoredAxiom] = ()
    events: Sequence[Event] = ()
    refuted: dict[str, str] = field(default_factory=dict)
    restored: Sequence[str] = ()
    changed: Sequence[str] = ()


@dataclass(frozen=True)
class LearnerContents:
    """What a learner.db holds of axioms."""

    cycle: int
    scenes: int
    axioms: tuple[StoredAxiom, ...]
    history: tuple[Event, ...]
    refuted: dict[str, str]


class LearnerStore:
    """The memory of the axiom learner.

    Attributes:
        trials: Attempts at actions.

    Args:
        path: SQLite file, or `state_file.IN_MEMORY`.
        health: Takes the report of a damaged file.
        kept_scenes: Of so many labelled scenes the content is kept.

    Raises:
        StateError: If the file cannot be used.
    """

    def __init__(self, path: Path, health: Health, kept_scenes: int) -> None:
        self._connection = open_state_file(
            path, _SCHEMA, VERSION, health, _MIGRATIONS, check_content
        )
        self.trials = TrialStore(self._connection)
        self._kept_scenes = kept_scenes

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()

    def add_scene(
        self,
        scene_id: str,
        state: SceneState,
        literals: Iterable[tuple[str, int, bool, Reason]],
        used: Iterable[tuple[str, bool]],
    ) -> bool:
        """Keeps a labelled scene: fluent, object, label and reason of each literal.

        Args:
            scene_id: The scene.
            state: What holds in it.
            literals: Its labels.
            used: Ids of the axioms that decided something, each with whether that was right.

        Returns:
            Whether it was new.
        """
        content = json.dumps([state.names, sorted(state.facts, key=repr)])
        with self._connection:
            fresh = self._connection.execute(
                "INSERT OR IGNORE INTO scene (scene_id, state) VALUES (?, ?)", (scene_id, content)
            )
            if fresh.rowcount == 0:
                return False
            number = fresh.lastrowid
            assert number is not None
            self._connection.executemany(
                "INSERT INTO literal VALUES (?, ?, ?, ?, ?)",
                ((number, *each) for each in literals),
            )
            self._connection.executemany(
                "UPDATE axiom SET right = right + ?, wrong = wrong + ? WHERE id = ?",
                ((int(right), int(not right), name) for name, right in used),
            )
            oldest = number - self._kept_scenes
            self._connection.execute("DELETE FROM literal WHERE scene <= ?", (oldest,))
            self._connection.execute(
                "UPDATE scene SET state = NULL WHERE number <= ? AND state IS NOT NULL", (oldest,)
            )
            self._connection.execute("DELETE FROM scene WHERE number <= ?", (number - _SCENE_IDS,))
        return True

    def scenes(self, new_only: bool = False) -> list[int]:
        """Numbers of the labelled scenes, oldest first.

        Args:
            new_only: Leave out those that were learned from already.
        """
        condition = " AND learned = 0" if new_only else ""
        rows = self._connection.execute(
            f"SELECT number FROM scene WHERE state IS NOT NULL{condition} ORDER BY number"
        )
        return [number for (number,) in rows]

    def examples(self, fluent: str, numbers: Sequence[int]) -> list[Example]:
        """The labelled objects of some scenes."""
        found = []
        for number in numbers:
            row = self._connection.execute(
                "SELECT scene_id, state FROM scene WHERE number = ?", (number,)
            ).fetchone()
            state = _state(row[1])
            for target, label, reason in self._connection.execute(
                "SELECT target, label, reason FROM literal WHERE scene = ? AND fluent = ?",
                (number, fluent),
            ):
                found.append(Example(row[0], state, target, bool(label), reason))
        return found

    def axioms(self, *states: AxiomState) -> list[StoredAxiom]:
        """The axioms in these states, oldest first; of all states if none is named."""
        found = _axioms(self._connection)
        return [each for each in found if not states or each.state in states]

    def history(self, axiom: str | None = None) -> Iterator[Event]:
        """What became of an axiom, or of all, in order."""
        return (each for each in _history(self._connection) if axiom in (None, each.axiom))

    def refuted(self) -> dict[str, str]:
        """Given axioms that are out of force, each with why."""
        return _refuted(self._connection)

    @property
    def cycle(self) -> int:
        """How many learning cycles there were."""
        return int(self._connection.execute("SELECT cycle FROM progress").fetchone()[0])

    @property
    def revision(self) -> int:
        """Grows with every change of the axioms."""
        return int(self._connection.execute("SELECT revision FROM progress").fetchone()[0])

    def finish_cycle(self, changes: Changes, learned: Sequence[int], now_ns: int = 0) -> None:
        """Writes what a cycle changed; the scenes of these numbers are not new any more."""
        with self._connection:
            self._apply(changes, now_ns)
            self._connection.execute("UPDATE axiom SET right = 0, wrong = 0")
            outdated = [(fluent, min(learned)) for fluent in changes.changed if learned]
            drop = "DELETE FROM literal WHERE fluent = ? AND scene < ?"
            self._connection.executemany(drop, outdated)
            mark = "UPDATE scene SET learned = 1 WHERE number = ?"
            self._connection.executemany(mark, ((each,) for each in learned))
            self._connection.execute("UPDATE progress SET cycle = cycle + 1")

    def answer(self, request: str) -> tuple[Outcome, str] | None:
        """What became of a request before; None if it is new."""
        question = "SELECT outcome, reason FROM request WHERE id = ?"
        row = self._connection.execute(question, (request,)).fetchone()
        return None if row is None else (row[0], row[1])

    def finish_request(
        self,
        request: str,
        outcome: Outcome,
        reason: str,
        changes: Changes | None,
        now_ns: int = 0,
    ) -> None:
        """Writes what became of a request."""
        with self._connection:
            if changes is not None:
                self._apply(changes, now_ns)
            self._connection.execute(
                "INSERT INTO request VALUES (?, ?, ?)", (request, outcome, reason)
            )

    def _apply(self, changes: Changes, now_ns: int) -> None:
        self._connection.executemany(
            "INSERT INTO axiom VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) "
            "ON CONFLICT (id) DO UPDATE SET state = excluded.state, "
            "decay = excluded.decay, idle = excluded.idle, "
            "support = excluded.support, purity = excluded.purity, pinned = excluded.pinned",
            (
                (
                    each.id,
                    each.text,
                    each.kind,
                    each.state,
                    each.strength.decay,
                    each.strength.idle,
                    each.support,
                    each.purity,
                    each.born,
                    each.pinned,
                    each.right,
                    each.wrong,
                )
                for each in changes.axioms
            ),
        )
        self._connection.executemany(
            "INSERT INTO event (cycle, axiom, what, strength, words, stamp_ns) "
            "VALUES (?, ?, ?, ?, ?, ?)",
            ((e.cycle, e.axiom, e.what, e.strength, e.words, now_ns) for e in changes.events),
        )
        self._connection.executemany(
            "INSERT OR REPLACE INTO refuted VALUES (?, ?)", changes.refuted.items()
        )
        self._connection.executemany(
            "DELETE FROM refuted WHERE axiom = ?", ((name,) for name in changes.restored)
        )
        self._connection.execute("UPDATE progress SET revision = revision + 1")


def look_into(path: Path) -> LearnerContents:
    """Reads a learner.db, also one that a node is writing.

    Raises:
        StateError: If there is none, or it cannot be read.
    """
    with read_state_file(path, VERSION) as connection:
        return LearnerContents(
            cycle=connection.execute("SELECT cycle FROM progress").fetchone()[0],
            scenes=connection.execute("SELECT count(*) FROM scene").fetchone()[0],
            axioms=tuple(_axioms(connection)),
            history=tuple(_history(connection)),
            refuted=_refuted(connection),
        )


def _axioms(connection: sqlite3.Connection) -> list[StoredAxiom]:
    rows = connection.execute(
        "SELECT id, text, kind, state, decay, idle, support, purity, born, pinned, right, "
        "wrong FROM axiom ORDER BY born, rowid"
    )
    return list(map(_axiom, rows))


def _history(connection: sqlite3.Connection) -> Iterator[Event]:
    for row in connection.execute(
        "SELECT cycle, axiom, what, strength, words, stamp_ns FROM event ORDER BY number"
    ):
        yield Event(*row)


def _refuted(connection: sqlite3.Connection) -> dict[str, str]:
    return dict(connection.execute("SELECT axiom, words FROM refuted ORDER BY axiom"))


def _state(text: str) -> SceneState:
    names, facts = msgspec.json.decode(text, type=tuple[tuple[str, ...], list[Fact]])
    return SceneState(names, frozenset(facts))


def _axiom(row: Sequence[Any]) -> StoredAxiom:
    id, text, kind, state, decay, idle, support, purity, born, pinned, right, wrong = row
    strength = Strength(decay, idle)
    return StoredAxiom(
        id, text, kind, state, strength, support, purity, born, bool(pinned), right, wrong
    )


def check_content(connection: sqlite3.Connection) -> None:
    """Reads all that the stage cannot do without."""
    try:
        for (text,) in connection.execute("SELECT state FROM scene WHERE state IS NOT NULL"):
            _state(text)
        TrialStore(connection).all()
    except msgspec.MsgspecError as error:
        raise sqlite3.DatabaseError(f"a scene or an action cannot be read: {error}") from error
