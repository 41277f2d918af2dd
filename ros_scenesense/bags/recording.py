"""A recording in progress: a bounded queue, and the one thread that writes the bag."""

from __future__ import annotations

import json
import shutil
import sqlite3
import threading
import time
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rosbags.rosbag2 import WriterError

import ros_scenesense
from ros_scenesense.bags.definitions import BagTopic
from ros_scenesense.bags.writing import BagCounts, BagFormat, BagWriter
from ros_scenesense.errors import BagError

FLUSH_S = 0.5
"""So much of the session at most is lost if the recorder is killed."""
SMALL_BYTES = 64 * 1024
"""Messages up to this size find a place in the queue that images cannot fill."""
_KEPT_FOR_SMALL = 0.25
# Looking at the disk costs more than writing a message.
_LOOK_EVERY = 200


@dataclass(frozen=True)
class RecordingLimits:
    """Bounds of a recording.

    Attributes:
        queue_bytes: What may wait to be written; what does not fit is dropped.
        bag_bytes: The recording ends when the bag holds so much; 0 = no limit.
        free_bytes: It also ends when the disk has less left.
    """

    queue_bytes: int
    bag_bytes: int = 0
    free_bytes: int = 0


class Recording:
    """Writes what is put into it to a bag, in a thread of its own.

    Args:
        folder: Of the bag; must not exist.
        format: How it is written.
        limits: Bounds of memory and disk.

    Attributes:
        folder: As given.
        dropped: Messages that found no place in the queue, by topic.

    Raises:
        BagError: If the folder cannot be made.
    """

    def __init__(self, folder: Path, format: BagFormat, limits: RecordingLimits) -> None:
        self.folder = folder
        self.dropped: Counter[str] = Counter()
        self._limits = limits
        self._ended: str | None = None
        self._closing = False
        self._waiting_bytes = 0
        self._queue: deque[tuple[str, int, bytes]] = deque()
        self._topics: dict[str, BagTopic] = {}
        self._changed = threading.Condition()
        self._writer = BagWriter(folder, format)
        self._thread = threading.Thread(target=self._run, name="bag writer", daemon=True)
        self._thread.start()

    @property
    def counts(self) -> BagCounts:
        """What the bag holds so far."""
        return self._writer.counts

    @property
    def waiting_bytes(self) -> int:
        """What waits to be written."""
        return self._waiting_bytes

    @property
    def ended(self) -> str | None:
        """Why nothing is written any more, in words; None while it is."""
        return self._ended

    def add_topic(self, topic: BagTopic) -> None:
        """Announces a topic; must precede its messages."""
        with self._changed:
            self._topics.setdefault(topic.name, topic)

    def put(self, topic: str, stamp_ns: int, data: bytes) -> bool:
        """Queues a message; returns whether there was room for it."""
        with self._changed:
            limit = self._limits.queue_bytes
            if len(data) > SMALL_BYTES:
                limit -= int(limit * _KEPT_FOR_SMALL)
            if self._ended or self._closing:
                return False
            if self._waiting_bytes + len(data) > limit:
                self.dropped[topic] += 1
                return False
            self._queue.append((topic, stamp_ns, data))
            self._waiting_bytes += len(data)
            self._changed.notify()
        return True

    def close(self, timeout_s: float) -> bool:
        """Writes what waits and finishes the bag; returns whether that was done in time."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._write_all()
        except (OSError, sqlite3.Error, WriterError) as error:
            self._end(f"bag {self.folder} cannot be written: {error}")
        try:
            self._writer.close(self._notes())
        except (OSError, sqlite3.Error, WriterError, BagError) as error:
            words = f"bag {self.folder} is not finished ({error}): `scenesense bag repair` it"
            self._end(words)

    def _write_all(self) -> None:
        flushed = time.monotonic()
        number = 0
        while True:
            batch, topics, closing = self._take()
            for topic in topics:
                self._writer.add_topic(topic)
            for name, stamp_ns, data in batch:
                self._writer.write(name, stamp_ns, data)
                with self._changed:
                    self._waiting_bytes -= len(data)
                number += 1
                if self._is_full() or (number % _LOOK_EVERY == 0 and self._disk_is_full()):
                    return
            if time.monotonic() - flushed >= FLUSH_S:
                self._writer.flush()
                flushed = time.monotonic()
            if closing and not batch:
                return

    def _take(self) -> tuple[list[tuple[str, int, bytes]], list[BagTopic], bool]:
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closing, timeout=FLUSH_S)
            batch = list(self._queue)
            self._queue.clear()
            topics, self._topics = list(self._topics.values()), {}
            return batch, topics, self._closing

    def _is_full(self) -> bool:
        written = self._writer.counts.payload_bytes
        full = 0 < self._limits.bag_bytes <= written
        if full:
            self._end(f"bag {self.folder} is full: it holds {written / 1e6:.0f} MB")
        return full

    def _disk_is_full(self) -> bool:
        full = shutil.disk_usage(self.folder).free < self._limits.free_bytes
        if full:
            mb = self._limits.free_bytes / 1e6
            self._end(f"the disk of bag {self.folder} has less than {mb:.0f} MB left")
        return full

    def _end(self, words: str) -> None:
        with self._changed:
            self._ended = f"{self._ended or 'recording ended'}: {words}"
            self._queue.clear()
            self._waiting_bytes = 0

    def _notes(self) -> Mapping[str, str]:
        notes = {"scenesense_version": ros_scenesense.__version__}
        if self.dropped:
            notes["dropped"] = json.dumps(dict(sorted(self.dropped.items())))
        if self._ended:
            notes["ended"] = self._ended
        return notes
