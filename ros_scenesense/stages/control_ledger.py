"""control.db: the scenes of late, what people said of them, the trust, and the outbox of evidence.

Every method that writes is one transaction: what belongs together is there or is not, whenever the
process is killed. What is to be published is written first.
"""

from __future__ import annotations

import json
import sqlite3
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from ros_scenesense.errors import MessageError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.grounding import (
    Groundings,
    MsrSample,
    MsrUpdate,
    PairGrounding,
    Relations,
    Trust,
)
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.state_file import open_state_file
from ros_scenesense.stages.statements import Statement, relation_named

# Also to be raised, with a migration, when a message that is kept gets a new version.
VERSION = 1
_SCHEMA = """
CREATE TABLE scene (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    scene_id TEXT NOT NULL UNIQUE
);
CREATE TABLE content (
    number INTEGER PRIMARY KEY REFERENCES scene,
    names TEXT NOT NULL,
    groundings BLOB NOT NULL,
    relations BLOB NOT NULL
);
CREATE TABLE feedback (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT UNIQUE,
    stamp_ns INTEGER NOT NULL,
    scene_id TEXT NOT NULL,
    first TEXT NOT NULL,
    second TEXT NOT NULL,
    kind TEXT NOT NULL CHECK (kind IN ('position', 'distance')),
    object TEXT NOT NULL,
    reference TEXT NOT NULL,
    relation TEXT NOT NULL,
    grounded TEXT NOT NULL,
    passed_on INTEGER NOT NULL,
    replaced_by INTEGER REFERENCES feedback
);
CREATE UNIQUE INDEX standing ON feedback (scene_id, first, second, kind)
    WHERE replaced_by IS NULL;
CREATE TABLE trust (
    revision INTEGER PRIMARY KEY,
    message TEXT NOT NULL
);
CREATE TABLE msr_update (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    message TEXT NOT NULL
);
"""
# No histograms are so much older than their ledger: ids must stay small enough to be counted on.
_LARGEST_STEP = 10**9

Content = TypeVar("Content", Groundings, Relations)

_SCENE_IDS = 10_000
"""So many scenes are recognised when they come again, long after their content is forgotten."""


@dataclass(frozen=True)
class Entry:
    """A feedback that counts.

    Attributes:
        id: Of the feedback, if it had one.
        stamp_ns: When it was given.
        scene_id: The scene it is about.
        statement: What it says.
        grounded: What the models said then of this pair, in the statement's direction and in the
            other one.
        passed_on: Whether the relations of the scene say the same.
    """

    id: str | None
    stamp_ns: int
    scene_id: str
    statement: Statement
    grounded: tuple[PairGrounding | None, PairGrounding | None]
    passed_on: bool


class ControlLedger:
    """The memory of the control stage.

    Args:
        path: SQLite file, or `state_file.IN_MEMORY`.
        health: Takes the report of a damaged file.
        remembered_scenes: Of so many scenes the groundings are kept, for feedback about them.

    Raises:
        StateError: If the file cannot be used.
    """

    def __init__(self, path: Path, health: Health, remembered_scenes: int) -> None:
        self._connection = open_state_file(path, _SCHEMA, VERSION, health, check=check_content)
        self._health = health
        self._remembered_scenes = remembered_scenes

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()

    def knows(self, scene_id: str) -> bool:
        """Whether the scene was recorded."""
        return self._one("SELECT 1 FROM scene WHERE scene_id = ?", scene_id) is not None

    def groundings(self, scene_id: str) -> Groundings | None:
        """The groundings of a scene; None if it is unknown or too old."""
        return self._content("groundings", Groundings, scene_id)

    def relations(self, scene_id: str) -> Relations | None:
        """The relations that were settled on in a scene; None if it is unknown or too old."""
        return self._content("relations", Relations, scene_id)

    def scenes(self) -> Iterator[tuple[str, list[str]]]:
        """The ids of the remembered scenes with the objects located there, newest first."""
        for scene_id, names in self._connection.execute(
            "SELECT scene_id, names FROM content JOIN scene USING (number) ORDER BY number DESC"
        ):
            yield scene_id, json.loads(names)

    def record_scene(
        self, groundings: Groundings, relations: Relations, samples: Sequence[Sequence[MsrSample]]
    ) -> None:
        """Writes a new scene, and an update for each group of samples; forgets what is too old."""
        names = sorted({name for one in groundings.pairs for name in (one.object, one.reference)})
        with self._connection:
            number = self._connection.execute(
                "INSERT INTO scene (scene_id) VALUES (?)", (groundings.scene_id,)
            ).lastrowid
            assert number is not None
            self._connection.execute(
                "INSERT INTO content VALUES (?, ?, ?, ?)",
                (
                    number,
                    json.dumps(names),
                    zlib.compress(encode(groundings), 1),
                    zlib.compress(encode(relations), 1),
                ),
            )
            for group in samples:
                self._append(groundings.stamp, group, agreement_dropped=False)
            oldest = number - self._remembered_scenes
            self._connection.execute("DELETE FROM content WHERE number <= ?", (oldest,))
            self._connection.execute("DELETE FROM scene WHERE number <= ?", (number - _SCENE_IDS,))

    def feedback_of(self, id: str) -> Entry | None:
        """The feedback of an id; None if there is none."""
        row = self._one(f"SELECT {_ENTRY} FROM feedback WHERE id = ?", id)
        return None if row is None else _entry(row)

    def standing(self, scene_id: str, statement: Statement) -> Entry | None:
        """What counts in a scene for the pair and kind of a statement; None if nothing does."""
        row = self._one(
            f"SELECT {_ENTRY} FROM feedback WHERE scene_id = ? AND first = ? AND second = ? "
            "AND kind = ? AND replaced_by IS NULL",
            scene_id,
            *statement.pair,
            statement.kind,
        )
        return None if row is None else _entry(row)

    def entries(self) -> Iterator[Entry]:
        """All that counts, oldest first: without what was replaced."""
        for row in self._connection.execute(
            f"SELECT {_ENTRY} FROM feedback WHERE replaced_by IS NULL ORDER BY number"
        ):
            yield _entry(row)

    def record_feedback(
        self, entry: Entry, trust: Trust, samples: Sequence[MsrSample], agreement_dropped: bool
    ) -> None:
        """Writes a feedback that counts, with the trust after it and the evidence it gives.

        What stood for the same pair, kind and scene is replaced.
        """
        statement = entry.statement
        with self._connection:
            # The new one is not there yet: until then the old one is replaced by itself.
            replaced = self._one(
                "UPDATE feedback SET replaced_by = number WHERE scene_id = ? AND first = ? "
                "AND second = ? AND kind = ? AND replaced_by IS NULL RETURNING number",
                entry.scene_id,
                *statement.pair,
                statement.kind,
            )
            number = self._connection.execute(
                "INSERT INTO feedback (id, stamp_ns, scene_id, first, second, kind, object, "
                "reference, relation, grounded, passed_on) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    entry.id,
                    entry.stamp_ns,
                    entry.scene_id,
                    *statement.pair,
                    statement.kind,
                    statement.object,
                    statement.reference,
                    statement.relation,
                    msgspec.json.encode(entry.grounded).decode(),
                    entry.passed_on,
                ),
            ).lastrowid
            if replaced is not None:
                self._connection.execute(
                    "UPDATE feedback SET replaced_by = ? WHERE number = ?", (number, replaced[0])
                )
            self._connection.execute(
                "INSERT INTO trust VALUES (?, ?)", (trust.revision, encode(trust).decode())
            )
            self._append(Stamp.of(entry.stamp_ns), samples, agreement_dropped)

    def trust(self) -> Trust | None:
        """The newest trust; None before any feedback."""
        row = self._one("SELECT message FROM trust ORDER BY revision DESC LIMIT 1")
        return None if row is None else decode(row[0], Trust)

    def pending(self, after: int = 0, limit: int = 100) -> list[MsrUpdate]:
        """The oldest updates with ids above one that are not known to be applied."""
        first = self._one("SELECT min(id) FROM msr_update")
        rows = self._connection.execute(
            "SELECT message FROM msr_update WHERE id > ? ORDER BY id LIMIT ?", (after, limit)
        )
        return [
            msgspec.structs.replace(decode(message, MsrUpdate), first_pending=first[0])
            for (message,) in rows
            if first is not None
        ]

    def recent_agreement(self, count: int) -> tuple[float, int]:
        """Of the last feedbacks, the share that the relations agreed with, and how many it were."""
        row = self._one(
            "SELECT coalesce(avg(passed_on), 0.0), count(*) FROM (SELECT passed_on FROM feedback "
            "WHERE replaced_by IS NULL ORDER BY number DESC LIMIT ?)",
            count,
        )
        assert row is not None
        return float(row[0]), int(row[1])

    def last_update(self) -> int:
        """The highest id that an update had, or that `applied` knew of; 0 before the first."""
        row = self._one("SELECT seq FROM sqlite_sequence WHERE name = 'msr_update'")
        return 0 if row is None else int(row[0])

    def applied(self, last: int) -> None:
        """All updates up to this id are applied; no new one gets an id up to it."""
        newest = self.last_update()
        if last > newest + _LARGEST_STEP:
            words = f"groundings say that update {last} is applied, of which the last is {newest}"
            self._health.problem("update_unknown", words)
            return
        try:
            with self._connection:
                self._connection.execute("DELETE FROM msr_update WHERE id <= ?", (last,))
                if last > newest:
                    # This file is younger than the histograms: their ids are not to be used again.
                    self._connection.execute(
                        "INSERT INTO msr_update (id, message) VALUES (?, '')", (last,)
                    )
                    self._connection.execute("DELETE FROM msr_update WHERE id = ?", (last,))
        except sqlite3.Error as error:
            words = f"what is applied could not be written to control.db: {error}"
            self._health.problem("not_remembered", words)

    def _content(self, column: str, kind: type[Content], scene_id: str) -> Content | None:
        row = self._one(
            f"SELECT {column} FROM content JOIN scene USING (number) WHERE scene_id = ?", scene_id
        )
        if row is None:
            return None
        try:
            return decode(zlib.decompress(row[0]), kind)
        except (MessageError, zlib.error) as error:
            words = f"{column} of scene {scene_id} in control.db cannot be read: {error}"
            self._health.problem("state_unreadable", words)
            return None

    def _append(self, stamp: Stamp, samples: Sequence[MsrSample], agreement_dropped: bool) -> None:
        number = self.last_update() + 1
        update = MsrUpdate(
            stamp=stamp,
            id=number,
            first_pending=number,
            samples=list(samples),
            agreement_dropped=agreement_dropped,
        )
        self._connection.execute(
            "INSERT INTO msr_update (id, message) VALUES (?, ?)", (number, encode(update).decode())
        )

    def _one(self, query: str, *values: object) -> tuple[Any, ...] | None:
        row: tuple[Any, ...] | None = self._connection.execute(query, values).fetchone()
        return row


_ENTRY = "id, stamp_ns, scene_id, object, reference, relation, grounded, passed_on"


def _entry(row: Sequence[Any]) -> Entry:
    id, stamp_ns, scene_id, object, reference, relation, grounded, passed_on = row
    return Entry(
        id=id,
        stamp_ns=stamp_ns,
        scene_id=scene_id,
        statement=Statement(object, reference, relation_named(relation)),
        grounded=msgspec.json.decode(grounded, type=_GROUNDED),
        passed_on=bool(passed_on),
    )


def check_content(connection: sqlite3.Connection) -> None:
    """Reads all that the stage cannot do without."""
    try:
        for row in connection.execute(f"SELECT {_ENTRY} FROM feedback"):
            _entry(row)
        for kind, table in ((Trust, "trust"), (MsrUpdate, "msr_update")):
            for (message,) in connection.execute(f"SELECT message FROM {table}"):
                decode(message, kind)
    except (MessageError, msgspec.MsgspecError, ValueError) as error:
        raise sqlite3.DatabaseError(f"a row cannot be read: {error}") from error


_GROUNDED = tuple[PairGrounding | None, PairGrounding | None]
