"""Reads bags: what they hold, and their messages in the order of time."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosbags.interfaces import ConnectionExtRosbag2, Qos
from rosbags.rosbag2 import Reader, ReaderError

from ros_scenesense.bags.writing import read_metadata
from ros_scenesense.errors import BagError
from ros_scenesense.stages.recorder import STATE_IN_BAG


@dataclass(frozen=True)
class RecordedTopic:
    """A topic of a bag: its full name, type, number of messages, and what publishers offered."""

    name: str
    type: str
    messages: int
    qos: tuple[Qos, ...]


@dataclass(frozen=True)
class BagDescription:
    """What a bag holds.

    Attributes:
        folder: Of the bag.
        storage: `mcap` or `sqlite3`.
        files: Names of its files, in order.
        size_bytes: Of all its files.
        start_ns: Time of the first message.
        duration_ns: From the first message to the last.
        topics: By name.
        notes: What the recorder said of it: its version, what was dropped, why it ended early.
        state: The state of the graph when the bag began; None if the bag has none.
    """

    folder: Path
    storage: str
    files: tuple[str, ...]
    size_bytes: int
    start_ns: int
    duration_ns: int
    topics: tuple[RecordedTopic, ...]
    notes: dict[str, str]
    state: Path | None

    @property
    def messages(self) -> int:
        """How many messages it holds."""
        return sum(topic.messages for topic in self.topics)

    @property
    def dropped(self) -> dict[str, int]:
        """Messages that were dropped when it was recorded, by topic."""
        found: dict[str, int] = json.loads(self.notes.get("dropped", "{}"))
        return found


def describe(folder: Path) -> BagDescription:
    """What a bag holds.

    Raises:
        BagError: If it is no bag, or was not finished.
    """
    information = read_metadata(folder)
    files = tuple(information["relative_file_paths"])
    missing = [name for name in files if not (folder / name).is_file()]
    if missing:
        raise BagError(f"{folder} lacks {', '.join(missing)}")
    state = folder / STATE_IN_BAG
    with _opened(folder) as reader:
        topics = tuple(map(_topic, sorted(reader.connections, key=lambda each: each.topic)))
    return BagDescription(
        folder=folder,
        storage=information["storage_identifier"],
        files=files,
        size_bytes=sum((folder / name).stat().st_size for name in files),
        start_ns=information["starting_time"]["nanoseconds_since_epoch"],
        duration_ns=information["duration"]["nanoseconds"],
        topics=topics,
        notes=information.get("custom_data") or {},
        state=state if state.is_file() else None,
    )


def read_messages(
    folder: Path, wanted: Callable[[str], bool] = lambda _topic: True
) -> Iterator[tuple[str, int, bytes]]:
    """The messages of a bag in the order of time: topic, time received (ns), bytes.

    Args:
        folder: Of the bag.
        wanted: Whether a topic of this name is wanted.

    Raises:
        BagError: If it is no bag, was not finished, or is damaged.
    """
    with _opened(folder) as reader:
        chosen = [each for each in reader.connections if wanted(each.topic)]
        if not chosen:
            return
        try:
            for connection, stamp_ns, data in reader.messages(chosen):
                yield connection.topic, stamp_ns, data
        except (ReaderError, OSError) as error:
            raise BagError(f"{folder} is damaged: {error}") from error


@contextmanager
def _opened(folder: Path) -> Iterator[Reader]:
    read_metadata(folder)
    try:
        reader = Reader(folder)
        reader.open()
    except (ReaderError, OSError, AssertionError) as error:
        raise BagError(f"{folder} cannot be read: {error}") from error
    try:
        yield reader
    finally:
        reader.close()


def _topic(connection: Any) -> RecordedTopic:
    extension = connection.ext
    assert isinstance(extension, ConnectionExtRosbag2)
    return RecordedTopic(
        connection.topic,
        connection.msgtype,
        connection.msgcount,
        tuple(extension.offered_qos_profiles),
    )
