"""Writes a bag: a rosbag2 folder with one or more files and their `metadata.yaml`.

Each file is written by the rosbags library as a bag of its own and then moved into the folder. What
was written is handed to the operating system at every `flush`, so that a killed process loses
little; `repair` finds it again.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import yaml
from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer

from ros_scenesense.bags.definitions import BagTopic
from ros_scenesense.errors import BagError

Storage = Literal["mcap", "sqlite3"]
METADATA = "metadata.yaml"
SUFFIX_OF: dict[str, str] = {"mcap": ".mcap", "sqlite3": ".db3"}
_PLUGIN_OF = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
_VERSION = 9
_INFORMATION = "rosbag2_bagfile_information"


@dataclass(frozen=True)
class BagFormat:
    """How a bag is written.

    Attributes:
        storage: `mcap` or `sqlite3`.
        compressed: Whether the chunks of an MCAP file are compressed (zstd).
        file_bytes: A new file begins when one is larger; 0 = there is one file.
    """

    storage: Storage = "mcap"
    compressed: bool = False
    file_bytes: int = 0


@dataclass
class BagCounts:
    """What a bag holds so far: messages, their bytes, finished files and messages by topic."""

    messages: int = 0
    payload_bytes: int = 0
    files: int = 0
    by_topic: dict[str, int] = field(default_factory=dict)


class BagWriter:
    """A bag that is being written. All methods are called from one thread (SQLite asks for it).

    Args:
        folder: Of the bag; must not exist.
        format: How it is written.

    Attributes:
        counts: What it holds.

    Raises:
        BagError: If the folder cannot be made.
    """

    def __init__(self, folder: Path, format: BagFormat) -> None:
        self.folder = folder
        self.counts = BagCounts()
        self._format = format
        self._topics: dict[str, BagTopic] = {}
        self._part: Writer | None = None
        self._connections: dict[str, Connection] = {}
        self._part_bytes = 0
        self._finished: list[dict[str, Any]] = []
        try:
            folder.mkdir(parents=True)
        except OSError as error:
            raise BagError(f"bag {folder} cannot be made: {error}") from error

    def add_topic(self, topic: BagTopic) -> None:
        """Adds a topic; one that is known already stays as it is."""
        if topic.name not in self._topics:
            self._topics[topic.name] = topic
            if self._part is not None:
                self._connect(self._part, topic)

    def write(self, topic: str, stamp_ns: int, data: bytes) -> None:
        """Writes a message.

        Args:
            topic: Name of a topic that was added.
            stamp_ns: When it was received.
            data: The serialised message (CDR).
        """
        if self._part is not None and 0 < self._format.file_bytes <= self._part_bytes:
            self._finish_part()
        part = self._part or self._begin_part()
        part.write(self._connections[topic], stamp_ns, data)
        self._part_bytes += len(data)
        self.counts.messages += 1
        self.counts.payload_bytes += len(data)
        self.counts.by_topic[topic] = self.counts.by_topic.get(topic, 0) + 1

    def flush(self) -> None:
        """Hands everything to the operating system: it outlives this process."""
        storage = None if self._part is None else self._part.storage
        if isinstance(storage, McapWriter):
            if storage.chunk.msgs:
                storage.close_chunk()
            storage.bio.flush()
        elif isinstance(storage, Sqlite3Writer):
            storage.conn.commit()

    def close(self, notes: Mapping[str, str]) -> None:
        """Finishes the bag and writes its `metadata.yaml`.

        Args:
            notes: Kept in the bag's `custom_data`.
        """
        if self._part is None and not self._finished:
            self._begin_part()
        if self._part is not None:
            self._finish_part()
        write_metadata(self.folder, self._finished, notes)

    def _begin_part(self) -> Writer:
        name = f"{self.folder.name}_{len(self._finished)}"
        plugin = _PLUGIN_OF[self._format.storage]
        part = Writer(self.folder / name, version=_VERSION, storage_plugin=plugin)
        if self._format.compressed:
            part.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        part.open()
        self._part, self._part_bytes, self._connections = part, 0, {}
        for topic in self._topics.values():
            self._connect(part, topic)
        return part

    def _connect(self, part: Writer, topic: BagTopic) -> None:
        self._connections[topic.name] = part.add_connection(
            topic.name,
            topic.type,
            msgdef=topic.definition,
            rihs01=topic.digest,
            offered_qos_profiles=topic.qos,
        )

    def _finish_part(self) -> None:
        part, self._part = self._part, None
        assert part is not None
        part.close()
        self._finished.append(move_part(part.path))
        self.counts.files = len(self._finished)


def move_part(part: Path) -> dict[str, Any]:
    """Moves the file of a finished part into the folder of its bag; its metadata."""
    information: dict[str, Any] = read_metadata(part)
    for name in information["relative_file_paths"]:
        (part / name).replace(part.parent / name)
    shutil.rmtree(part)
    return information


def read_metadata(folder: Path) -> dict[str, Any]:
    """What the `metadata.yaml` of a bag says.

    Raises:
        BagError: If there is none, or it is damaged.
    """
    try:
        document = yaml.load((folder / METADATA).read_text(), yaml.CSafeLoader)
        information: dict[str, Any] = document[_INFORMATION]
    except FileNotFoundError:
        raise BagError(
            f"{folder} has no {METADATA}: it is no bag, or its recorder was killed; "
            f"`scenesense bag repair {folder}` makes it whole"
        ) from None
    except (OSError, UnicodeError, yaml.YAMLError, KeyError, TypeError) as error:
        raise BagError(f"{folder / METADATA} is damaged: {' '.join(str(error).split())}") from error
    return information


def write_metadata(folder: Path, parts: list[dict[str, Any]], notes: Mapping[str, str]) -> None:
    """Writes the `metadata.yaml` of a bag.

    Args:
        folder: Of the bag.
        parts: What the metadata of each file said.
        notes: For `custom_data`.
    """
    filled = [part for part in parts if part["message_count"]]
    starts = [part["starting_time"]["nanoseconds_since_epoch"] for part in filled]
    ends = [
        start + part["duration"]["nanoseconds"] for start, part in zip(starts, filled, strict=True)
    ]
    topics: dict[str, dict[str, Any]] = {}
    for part in parts:
        for topic in part["topics_with_message_count"]:
            known = topics.setdefault(
                topic["topic_metadata"]["name"], {**topic, "message_count": 0}
            )
            known["message_count"] += topic["message_count"]
    information = {
        **parts[0],
        "relative_file_paths": [name for part in parts for name in part["relative_file_paths"]],
        "files": [file for part in parts for file in part["files"]],
        "starting_time": {"nanoseconds_since_epoch": min(starts, default=0)},
        "duration": {"nanoseconds": max(ends, default=0) - min(starts, default=0)},
        "message_count": sum(part["message_count"] for part in parts),
        "topics_with_message_count": list(topics.values()),
        "custom_data": dict(notes) or None,
    }
    temporary = folder / f"{METADATA}.tmp"
    # Copies of what is shared: other readers of bags need not know the anchors of YAML.
    copied = json.loads(json.dumps({_INFORMATION: information}))
    temporary.write_text(yaml.safe_dump(copied, sort_keys=False))
    temporary.replace(folder / METADATA)
