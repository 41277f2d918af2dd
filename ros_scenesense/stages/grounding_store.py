"""grounding.db: what prepositions mean, as learned, and the histograms of the scenes of late.

Each update is one transaction: its evidence is merged and its id written, or neither, whenever the
process is killed. What people said is kept one by one, so that it can be taken back.
"""

from __future__ import annotations

import io
import json
import sqlite3
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ros_scenesense.grounding.memory import Example, GroundingMemory
from ros_scenesense.grounding.msr import MetricSettings, Source
from ros_scenesense.messages.grounding import MsrSample, MsrUpdate
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.scene_records import SceneRecord, pack_pair, unpack_pair
from ros_scenesense.stages.state_file import open_state_file, read_state_file
from ros_scenesense.stages.statements import Statement, relation_named

# Also to be raised, with a migration, when what the model keeps changes its shape.
VERSION = 1
_SCHEMA = """
CREATE TABLE learned (
    only INTEGER PRIMARY KEY CHECK (only = 1),
    applied INTEGER NOT NULL,
    memory BLOB NOT NULL
);
CREATE TABLE scene (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    scene_id TEXT NOT NULL UNIQUE,
    names TEXT NOT NULL,
    yaw REAL NOT NULL,
    histograms BLOB NOT NULL
);
CREATE TABLE taught (
    scene_id TEXT NOT NULL,
    first TEXT NOT NULL,
    second TEXT NOT NULL,
    kind TEXT NOT NULL,
    PRIMARY KEY (scene_id, first, second, kind)
) WITHOUT ROWID;
CREATE TABLE told (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    scene_id TEXT NOT NULL,
    first TEXT NOT NULL,
    second TEXT NOT NULL,
    kind TEXT NOT NULL,
    relation TEXT NOT NULL,
    dropped INTEGER NOT NULL,
    moved INTEGER NOT NULL,
    yaw REAL NOT NULL,
    histograms BLOB NOT NULL,
    UNIQUE (scene_id, first, second, kind)
);
"""


class GroundingStore:
    """The memory of the grounding stage, on disk.

    Args:
        path: SQLite file, or `state_file.IN_MEMORY`.
        health: Takes the report of a damaged file, and of evidence that cannot be merged.
        remembered_scenes: Of so many scenes the histograms are kept, for feedback about them.
        settings: How examples are weighted against each other.

    Attributes:
        memory: What was learned; each update replaces it.
        applied: Id of the last update that it contains.

    Raises:
        StateError: If the file cannot be used.
    """

    def __init__(
        self, path: Path, health: Health, remembered_scenes: int, settings: MetricSettings
    ) -> None:
        self._connection = open_state_file(path, _SCHEMA, VERSION, health, check=read_learned)
        self._health = health
        self._remembered_scenes = remembered_scenes
        self._settings = settings
        self.applied, self.memory = read_learned(self._connection, settings)

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()

    def record_scene(self, record: SceneRecord) -> None:
        """Keeps the histograms of a scene, the first of a scene; forgets what is too old.

        A file that cannot be written, on a full disk say, is a problem for the health, here and
        in `apply`: the scene itself goes on.
        """
        try:
            self._record_scene(record)
        except sqlite3.Error as error:
            words = f"scene {record.scene_id} could not be written to grounding.db: {error}"
            self._health.problem("not_remembered", words)

    def apply(self, update: MsrUpdate) -> bool:
        """Merges the evidence of an update if it is the next one; returns whether it was.

        The next one follows the last applied, unless updates are missing that nobody will send.
        """
        if update.id != max(self.applied + 1, update.first_pending):
            return False
        if update.id > self.applied + 1:
            self._health.problem(
                "evidence_lost",
                f"the evidence of the updates {self.applied + 1} to {update.id - 1} is lost: "
                "grounding.db is older than control.db",
            )
        try:
            with self._connection:
                memory = self._memory_after(update)
                self._write(update.id, memory)
        except sqlite3.Error as error:
            words = f"update {update.id} could not be written to grounding.db: {error}"
            self._health.problem("not_remembered", words)
            return False
        self.applied, self.memory = update.id, memory
        return True

    def expect_change(self) -> bool:
        """The camera is known to have moved; returns whether that could be written."""
        memory = GroundingMemory.from_arrays(self.memory.to_arrays(), self._settings)
        memory.expect_change()
        try:
            with self._connection:
                self._write(self.applied, memory)
        except sqlite3.Error as error:
            words = f"that the camera moved could not be written to grounding.db: {error}"
            self._health.problem("not_remembered", words)
            return False
        self.memory = memory
        return True

    def _write(self, applied: int, memory: GroundingMemory) -> None:
        self._connection.execute(
            "INSERT OR REPLACE INTO learned VALUES (1, ?, ?)", (applied, _memory_bytes(memory))
        )

    def _record_scene(self, record: SceneRecord) -> None:
        with self._connection:
            cursor = self._connection.execute(
                "INSERT OR IGNORE INTO scene (scene_id, names, yaw, histograms) "
                "VALUES (?, ?, ?, ?)",
                (record.scene_id, json.dumps(record.names), record.yaw_rad, record.packed),
            )
            if not cursor.rowcount or cursor.lastrowid is None:
                return
            old = self._connection.execute(
                "DELETE FROM scene WHERE number <= ? RETURNING scene_id",
                (cursor.lastrowid - self._remembered_scenes,),
            ).fetchall()
            self._connection.executemany("DELETE FROM taught WHERE scene_id = ?", old)

    def _memory_after(self, update: MsrUpdate) -> GroundingMemory:
        memory = GroundingMemory.from_arrays(self.memory.to_arrays(), self._settings)
        examples, taken_back = [], False
        record: SceneRecord | None = None
        for sample in update.samples:
            if record is None or record.scene_id != sample.scene_id:
                record = self._record(sample.scene_id)
            example = None if record is None else record.example(sample)
            if example is None:
                self._miss(sample)
            elif example.source is Source.HUMAN:
                taken_back |= self._tell(sample, example, update.agreement_dropped)
                examples.append(example)
            elif self._is_new(sample):
                examples.append(example)
        memory.learn(examples, update.agreement_dropped)
        return self._told_again(memory) if taken_back else memory

    def _miss(self, sample: MsrSample) -> None:
        if sample.source != "human":
            self._health.count("evidence_without_scene")
            return
        self._health.problem(
            "word_without_scene",
            f"what a person said of '{sample.object}' and '{sample.reference}' in scene "
            f"{sample.scene_id} teaches nothing: what was seen of them is not remembered; give "
            "grounding and grounding_control the same remembered_scenes",
        )

    def _is_new(self, sample: MsrSample) -> bool:
        """Whether a pair of a scene teaches for the first time; notes that it did."""
        cursor = self._connection.execute(
            "INSERT OR IGNORE INTO taught VALUES (?, ?, ?, ?)", _key(sample)
        )
        return cursor.rowcount > 0

    def _tell(self, sample: MsrSample, example: Example, dropped: bool) -> bool:
        """Notes what a person said; returns whether that takes back what was said before."""
        key = _key(sample)
        taken_back = self._connection.execute(
            "DELETE FROM told WHERE scene_id = ? AND first = ? AND second = ? AND kind = ? "
            "RETURNING number, moved",
            key,
        ).fetchone()
        self._connection.execute(
            "INSERT INTO told (scene_id, first, second, kind, relation, dropped, moved, yaw, "
            "histograms) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                *key,
                sample.relation,
                dropped,
                self.memory.viewpoint.expects_change,
                example.forward.yaw_rad,
                pack_pair(example),
            ),
        )
        if taken_back is None:
            return False
        if taken_back[1]:  # the camera moved all the same: before the word that comes next
            self._connection.execute(
                "UPDATE told SET moved = 1 WHERE number = "
                "(SELECT min(number) FROM told WHERE number > ?)",
                taken_back[:1],
            )
        return True

    def _told_again(self, memory: GroundingMemory) -> GroundingMemory:
        """A memory without what people took back.

        A mean cannot be unlearned, so all that they said and still say is learned anew.
        """
        afresh = GroundingMemory(self._settings)
        for relation, dropped, moved, yaw, packed in self._connection.execute(
            "SELECT relation, dropped, moved, yaw, histograms FROM told ORDER BY number"
        ):
            if moved:
                afresh.expect_change()
            forward, backward = unpack_pair(packed, yaw)
            example = Example(relation_named(relation), forward, backward, Source.HUMAN)
            afresh.learn([example], bool(dropped))
        arrays, by_source = memory.to_arrays(), memory.model.to_arrays()
        human = list(Source).index(Source.HUMAN)
        for name, array in afresh.to_arrays().items():
            if name in by_source:
                arrays[name][:, human] = array[:, human]
            else:
                arrays[name] = array
        return GroundingMemory.from_arrays(arrays, self._settings)

    def _record(self, scene_id: str) -> SceneRecord | None:
        row = self._connection.execute(
            "SELECT scene_id, names, yaw, histograms FROM scene WHERE scene_id = ?", (scene_id,)
        ).fetchone()
        return None if row is None else SceneRecord(row[0], json.loads(row[1]), row[2], row[3])


@dataclass(frozen=True)
class StoreContents:
    """What a state file holds, for people.

    Attributes:
        memory: What was learned.
        updates: Number of the last update that was merged.
        told: How many statements of people are kept.
        scenes: How many scenes feedback may still be about.
    """

    memory: GroundingMemory
    updates: int
    told: int
    scenes: int


def look_into(path: Path) -> StoreContents:
    """Reads a grounding.db, also one that a node is writing.

    Raises:
        StateError: If there is none, or it cannot be read.
    """
    with read_state_file(path, VERSION) as connection:
        updates, memory = read_learned(connection)
        told, scenes = (
            connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
            for table in ("told", "scene")
        )
        return StoreContents(memory, updates, told, scenes)


def read_learned(
    connection: sqlite3.Connection, settings: MetricSettings | None = None
) -> tuple[int, GroundingMemory]:
    """The last update that was applied, and what was learned.

    Raises:
        sqlite3.DatabaseError: If what the file holds is none.
    """
    row = connection.execute("SELECT applied, memory FROM learned").fetchone()
    if row is None:
        return 0, GroundingMemory(settings)
    try:
        with np.load(io.BytesIO(row[1]), allow_pickle=False) as arrays:
            return int(row[0]), GroundingMemory.from_arrays(dict(arrays), settings)
    except (ValueError, OSError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise sqlite3.DatabaseError(f"what was learned cannot be read: {error}") from error


def _memory_bytes(memory: GroundingMemory) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **memory.to_arrays())  # type: ignore[arg-type]
    return buffer.getvalue()


def _key(sample: MsrSample) -> tuple[str, str, str, str]:
    statement = Statement(sample.object, sample.reference, relation_named(sample.relation))
    return sample.scene_id, *statement.pair, statement.kind
