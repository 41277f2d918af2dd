"""attention.db: examples, how often each default was right, networks, and what was decided lately.

Every scene is applied once: what arrives twice, or again after a restart, changes nothing.
"""

from __future__ import annotations

import sqlite3
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.inputs import pack
from ros_scenesense.attention.queries import Query
from ros_scenesense.errors import NetworkError
from ros_scenesense.scene import Task
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.packed_examples import PackedExamples
from ros_scenesense.stages.state_file import open_state_file

VERSION = 5
_SCHEMA = """
CREATE TABLE judged (scene_id TEXT PRIMARY KEY) WITHOUT ROWID;
CREATE TABLE example (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    scene_id TEXT NOT NULL,
    task TEXT NOT NULL,
    target TEXT NOT NULL,
    label INTEGER NOT NULL,
    image BLOB NOT NULL,
    numbers BLOB NOT NULL,
    UNIQUE (scene_id, task, target)
);
CREATE TABLE conclusion (
    axiom TEXT PRIMARY KEY,
    right INTEGER NOT NULL,
    wrong INTEGER NOT NULL
) WITHOUT ROWID;
CREATE TABLE network (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    revision TEXT NOT NULL UNIQUE,
    file TEXT NOT NULL,
    examples INTEGER NOT NULL,
    loss REAL
);
"""
_DECISIONS = """
CREATE TABLE decision (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    stamp_ns INTEGER NOT NULL UNIQUE
);
"""
_TRAINED = """
CREATE TABLE trained (examples_ever INTEGER NOT NULL);
INSERT INTO trained SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'example';
"""
_FORGET = "DELETE FROM example; DELETE FROM network;"
_MIGRATIONS = (_FORGET, _DECISIONS, _FORGET, _TRAINED)
"""Examples of versions 1 to 3 lack numbers that networks are shown now; their networks do not know
them."""
_KEPT_DECISIONS = 1000  # topics keep 200 for who starts again
_OUTPUT = {Task.STABILITY: 0, Task.OCCLUSION: 1}
_HELD_OUT_OF = 5  # one scene of five


@dataclass(frozen=True)
class KnownNetwork:
    """A network that was adopted: its revision, its file, and what it was trained on."""

    revision: str
    file: str
    examples: int
    loss: float | None


class AttentionStore:
    """The memory of the attention stage.

    Args:
        path: SQLite file, or `state_file.IN_MEMORY`.
        health: Takes the report of a damaged file.
        side: Pixels of the images that are kept.
        kept_examples: So many are kept, the newest ones; None = all.

    Raises:
        StateError: If the file cannot be used.
    """

    def __init__(
        self, path: Path, health: Health, side: int, kept_examples: int | None = None
    ) -> None:
        self._side = side
        self._kept = kept_examples
        self._health = health
        schema = _SCHEMA + _DECISIONS + _TRAINED
        self._connection = open_state_file(path, schema, VERSION, health, _MIGRATIONS)

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()

    def add(
        self,
        scene_id: str,
        conclusions: Iterable[tuple[str, bool]],
        examples: Iterable[tuple[Query, bool]],
    ) -> bool:
        """Keeps what a labelled scene teaches.

        Args:
            scene_id: The scene.
            conclusions: Ids of the defaults that reasoning drew on, each with whether it was right.
            examples: Queries with their labels.

        Returns:
            Whether the scene was new, and could be kept.
        """
        try:
            with self._connection:
                fresh = self._connection.execute(
                    "INSERT OR IGNORE INTO judged VALUES (?)", (scene_id,)
                )
                if fresh.rowcount == 0:
                    return False
                self._count(conclusions)
                self._connection.executemany(
                    "INSERT INTO example (scene_id, task, target, label, image, numbers) "
                    "VALUES (?, ?, ?, ?, ?, ?)",
                    (
                        (
                            scene_id,
                            str(query.task),
                            query.target,
                            int(label),
                            pack(query.image),
                            query.numbers.tobytes(),
                        )
                        for query, label in examples
                    ),
                )
                if self._kept is not None:
                    self._connection.execute(
                        "DELETE FROM example WHERE number <= ?", (self.examples_ever - self._kept,)
                    )
        except sqlite3.Error as error:
            words = f"scene {scene_id} could not be written to attention.db: {error}"
            self._health.problem("not_remembered", words)
            return False
        return True

    def record_decisions(self, stamps_ns: Iterable[int]) -> None:
        """Remembers that the scenes of these stamps are decided; the oldest are forgotten."""
        try:
            with self._connection:
                self._connection.executemany(
                    "INSERT OR IGNORE INTO decision (stamp_ns) VALUES (?)",
                    ((stamp_ns,) for stamp_ns in stamps_ns),
                )
                self._connection.execute(
                    "DELETE FROM decision WHERE number <= (SELECT max(number) FROM decision) - ?",
                    (_KEPT_DECISIONS,),
                )
        except sqlite3.Error as error:
            words = f"decisions could not be written to attention.db: {error}"
            self._health.problem("not_remembered", words)

    def decided(self) -> frozenset[int]:
        """Stamps of the scenes that were decided lately, in nanoseconds."""
        rows = self._connection.execute("SELECT stamp_ns FROM decision")
        return frozenset(stamp_ns for (stamp_ns,) in rows)

    @property
    def example_count(self) -> int:
        """How many examples there are."""
        return int(self._connection.execute("SELECT count(*) FROM example").fetchone()[0])

    @property
    def examples_ever(self) -> int:
        """How many examples there were, with those that are forgotten."""
        row = self._connection.execute(
            "SELECT seq FROM sqlite_sequence WHERE name = 'example'"
        ).fetchone()
        return 0 if row is None else int(row[0])

    @property
    def trained_on(self) -> int:
        """How many examples had come, ever, when the last training that ended began."""
        return int(self._connection.execute("SELECT examples_ever FROM trained").fetchone()[0])

    def record_training(self, examples_ever: int) -> None:
        """Remembers that a training ended which began when so many examples had come."""
        with self._connection:
            self._connection.execute("UPDATE trained SET examples_ever = ?", (examples_ever,))

    def conclusions(self) -> dict[str, tuple[int, int]]:
        """How often each default was right and wrong, by axiom."""
        rows = self._connection.execute("SELECT axiom, right, wrong FROM conclusion")
        return {axiom: (right, wrong) for axiom, right, wrong in rows}

    def training_set(self) -> PackedExamples:
        """All examples. About one scene of five is held out, always the same ones.

        Raises:
            NetworkError: If there are none.
        """
        rows = self._connection.execute(
            "SELECT scene_id, task, label, image, numbers FROM example ORDER BY number"
        ).fetchall()
        if not rows:
            raise NetworkError("there is nothing to train on: collect labelled examples first")
        answers = np.full((len(rows), len(_OUTPUT)), np.nan, np.float32)
        for row, (_, task, label, _, _) in zip(answers, rows, strict=True):
            row[_OUTPUT[Task(task)]] = label
        scenes = np.array([zlib.crc32(row[0].encode()) for row in rows], np.int64)
        return PackedExamples(
            side=self._side,
            images=tuple(row[3] for row in rows),
            numbers=tuple(row[4] for row in rows),
            answers=answers,
            groups=scenes,
            held_out=_held_out(scenes),
        )

    def network(self) -> KnownNetwork | None:
        """The network adopted last."""
        row = self._connection.execute(
            "SELECT revision, file, examples, loss FROM network ORDER BY number DESC LIMIT 1"
        ).fetchone()
        return None if row is None else KnownNetwork(*row)

    def adopt(self, network: KnownNetwork) -> None:
        """Makes a network the one in use."""
        with self._connection:
            self._connection.execute(
                "INSERT INTO network (revision, file, examples, loss) VALUES (?, ?, ?, ?)",
                (network.revision, network.file, network.examples, network.loss),
            )

    def _count(self, conclusions: Iterable[tuple[str, bool]]) -> None:
        self._connection.executemany(
            "INSERT INTO conclusion VALUES (?, ?, ?) ON CONFLICT (axiom) DO UPDATE SET "
            "right = right + excluded.right, wrong = wrong + excluded.wrong",
            ((axiom, int(right), int(not right)) for axiom, right in conclusions),
        )


def _held_out(scenes: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Which examples are held out, by the hash of their scene: it stays so whatever comes later."""
    chosen: npt.NDArray[np.bool_] = scenes % _HELD_OUT_OF == 0
    if not chosen.any():  # so it may happen with few scenes, but one is needed
        chosen = scenes == scenes.min()
    return chosen
