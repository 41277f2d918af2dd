"""Makes whole what a killed recorder left: a bag without `metadata.yaml`, its last file cut off."""

from __future__ import annotations

import shutil
import sqlite3
import struct
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosbags.interfaces import ConnectionExtRosbag2
from rosbags.rosbag2 import Reader, ReaderError
from rosbags.rosbag2.metadata import dump_qos_v9

from ros_scenesense.bags.definitions import digest_of
from ros_scenesense.bags.mcap_scan import has_end, scan
from ros_scenesense.bags.writing import (
    METADATA,
    SUFFIX_OF,
    BagFormat,
    BagWriter,
    read_metadata,
    write_metadata,
)
from ros_scenesense.errors import BagError

_SCRATCH = ".repaired"


@dataclass(frozen=True)
class Repair:
    """What was done to a bag: files that were sound and that were saved, messages in all."""

    sound: int
    saved: int
    messages: int


def repair(folder: Path) -> Repair | None:
    """Makes a bag whole up to the last complete chunk (MCAP) or transaction (SQLite).

    Files that are sound stay as they are; of one that is cut off what can be read is written anew,
    and takes its place when that is done.

    Returns:
        What was done; None if the bag is whole already.

    Raises:
        BagError: If there is nothing to repair, or it cannot be read or written.
    """
    if (folder / METADATA).is_file():
        read_metadata(folder)
        return None
    files = _files(folder)
    if not files:
        raise BagError(f"{folder} holds no file of a bag")
    saved = 0
    parts = []
    try:
        for file in files:
            part = _described(file)
            if part is None:
                saved += 1
                part = _described(_save(folder, file))
            if part is None:
                raise BagError(f"{file} cannot be read")
            _settle(folder, file)
            parts.append(part)
        write_metadata(folder, parts, {"repaired": f"{saved} of {len(files)} files"})
    except (OSError, sqlite3.Error, struct.error) as error:
        raise BagError(f"{folder} cannot be repaired: {error}") from error
    return Repair(len(files) - saved, saved, sum(part["message_count"] for part in parts))


def _files(folder: Path) -> list[Path]:
    """The files of a bag in order; the one that was being written lies in a folder of its own."""
    found: dict[int, Path] = {}
    for suffix in SUFFIX_OF.values():
        for file in (*folder.glob(f"*{suffix}"), *folder.glob(f"*/*{suffix}")):
            number = file.stem.rpartition("_")[2]
            if file.parent.name != _SCRATCH and number.isdecimal():
                found[int(number)] = file
    return [found[number] for number in sorted(found)]


def _described(file: Path) -> dict[str, Any] | None:
    """What the metadata of a file would say; None if it is an MCAP file without its end."""
    mcap = file.suffix == SUFFIX_OF["mcap"]
    if mcap and not has_end(file):
        return None
    if not mcap:
        # Takes back the transaction that was under way.
        with closing(sqlite3.connect(file)) as connection:
            connection.execute("SELECT count(*) FROM messages").fetchone()
    try:
        with Reader(file) as reader:
            start_ns = reader.start_time if reader.message_count else 0
            described = {
                "path": file.name,
                "starting_time": {"nanoseconds_since_epoch": start_ns},
                "duration": {"nanoseconds": max(0, reader.duration - 1)},
                "message_count": reader.message_count,
            }
            topics = [
                {
                    "topic_metadata": {
                        "name": each.topic,
                        "type": each.msgtype,
                        "serialization_format": each.ext.serialization_format,
                        "offered_qos_profiles": dump_qos_v9(list(each.ext.offered_qos_profiles)),
                        "type_description_hash": each.digest or digest_of(each.msgtype),
                    },
                    "message_count": each.msgcount,
                }
                for each in reader.connections
                if isinstance(each.ext, ConnectionExtRosbag2)
            ]
    except ReaderError as error:
        raise BagError(f"{file} is damaged: {error}") from None
    return {
        "version": 9,
        "storage_identifier": "mcap" if mcap else "sqlite3",
        "relative_file_paths": [file.name],
        **{key: described[key] for key in ("starting_time", "duration", "message_count")},
        "topics_with_message_count": topics,
        "compression_format": "",
        "compression_mode": "",
        "files": [described],
        "ros_distro": "rosbags",
    }


def _save(folder: Path, file: Path) -> Path:
    """Writes what can be read of an MCAP file anew, in its place."""
    scratch = folder / _SCRATCH
    shutil.rmtree(scratch, ignore_errors=True)
    writer = BagWriter(scratch, BagFormat())
    for message in scan(file):
        writer.add_topic(message.topic)
        writer.write(message.topic.name, message.stamp_ns, message.data)
    writer.close({})
    (scratch / f"{_SCRATCH}_0.mcap").replace(file)
    shutil.rmtree(scratch)
    return file


def _settle(folder: Path, file: Path) -> None:
    """Puts a file that lies in a folder of its own beside the others."""
    if file.parent != folder:
        file.replace(folder / file.name)
        shutil.rmtree(file.parent)
