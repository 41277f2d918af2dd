"""Reads an MCAP file whose end is missing, as a killed recorder leaves it: record by record.

What is read are complete records alone: a chunk that is cut off, or whose checksum is wrong, ends
the reading. The format is described at mcap.dev.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BufferedIOBase, BytesIO
from pathlib import Path

from rosbags.rosbag2 import ReaderError
from rosbags.rosbag2.metadata import parse_qos
from rosbags.rosbag2.storage_mcap import decompress

from ros_scenesense.bags.definitions import BagTopic, digest_of
from ros_scenesense.errors import BagError

MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x03, 0x04, 0x05, 0x06
_LARGEST_RECORD = 2**31


@dataclass(frozen=True)
class ScannedMessage:
    """A message: its topic, when it was received, and its bytes."""

    topic: BagTopic
    stamp_ns: int
    data: bytes


def has_end(path: Path) -> bool:
    """Whether a file was finished: whether it ends as MCAP files do."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - len(MAGIC)))
        return size > 2 * len(MAGIC) and file.read() == MAGIC


def scan(path: Path) -> Iterator[ScannedMessage]:
    """The messages of a file, as far as it can be read, in the order in which they were written.

    Args:
        path: The file.

    Raises:
        BagError: If it is no MCAP file.
    """
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise BagError(f"{path} is no MCAP file")
        known = _Known()
        for kind, body in _records(file):
            if kind != _CHUNK:
                yield from known.take(kind, body)
                continue
            try:
                content = _unpacked(body)
            except (ReaderError, struct.error, UnicodeError):
                return
            for inner, inner_body in _records(BytesIO(content)):
                yield from known.take(inner, inner_body)


class _Known:
    """Schemas and channels so far."""

    def __init__(self) -> None:
        self._schemas: dict[int, tuple[str, str]] = {}
        self._topics: dict[int, BagTopic] = {}

    def take(self, kind: int, body: bytes) -> Iterator[ScannedMessage]:
        """Takes a record; gives the message that it is, if it is one."""
        fields = _Fields(body)
        if kind == _SCHEMA:
            (number,) = fields.numbers("<H")
            name, _encoding, definition = fields.text(), fields.text(), fields.text()
            self._schemas[number] = (name, definition)
        elif kind == _CHANNEL:
            number, schema = fields.numbers("<HH")
            name, _format = fields.text(), fields.text()
            type, definition = self._schemas[schema]
            qos = parse_qos(fields.pairs().get("offered_qos_profiles", ""))
            # MCAP does not keep the hash of a type.
            self._topics[number] = BagTopic(name, type, definition, digest_of(type), tuple(qos))
        elif kind == _MESSAGE:
            number, _sequence, stamp_ns, _published = fields.numbers("<HIQQ")
            yield ScannedMessage(self._topics[number], stamp_ns, fields.rest())


class _Fields:
    """The fields of a record, one after the other."""

    def __init__(self, body: bytes) -> None:
        self._body = body
        self._at = 0

    def numbers(self, format: str) -> tuple[int, ...]:
        values = struct.unpack_from(format, self._body, self._at)
        self._at += struct.calcsize(format)
        return values

    def text(self) -> str:
        (length,) = self.numbers("<I")
        return self._take(length).decode()

    def pairs(self) -> dict[str, str]:
        (length,) = self.numbers("<I")
        end = self._at + length
        found = {}
        while self._at < end:
            name = self.text()
            found[name] = self.text()
        return found

    def rest(self) -> bytes:
        return self._body[self._at :]

    def _take(self, length: int) -> bytes:
        taken = self._body[self._at : self._at + length]
        if len(taken) < length:
            raise struct.error("a record is shorter than it says")
        self._at += length
        return taken


def _records(file: BufferedIOBase) -> Iterator[tuple[int, bytes]]:
    """The complete records from here on, each as its kind and its content."""
    while len(head := file.read(9)) == 9:
        kind, length = struct.unpack("<BQ", head)
        if length > _LARGEST_RECORD:
            return
        body = file.read(length)
        if len(body) < length:
            return
        yield kind, body


def _unpacked(chunk: bytes) -> bytes:
    fields = _Fields(chunk)
    _start, _end, size, checksum = fields.numbers("<QQQI")
    compression = fields.text()
    (length,) = fields.numbers("<Q")
    return bytes(decompress(fields.rest()[:length], compression, size, checksum))
