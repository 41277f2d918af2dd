"""The files of a dataset, and what is wrong with them.

    metadata.json        what the dataset is
    scenes.jsonl         one record per line
    index.jsonl          one line per scene with the checksums of its record and of its images
    color/000000.png     ... depth/, instances/

A scene is complete when its line in the index is there and every checksum fits. That line is
written last, so whatever a run was doing when it ended, what it had finished is known.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec

from ros_scenesense.errors import DatasetError
from ros_scenesense.simulation.dataset.images import KINDS
from ros_scenesense.simulation.dataset.metadata import Metadata
from ros_scenesense.simulation.dataset.record import SceneRecord


@dataclass(frozen=True)
class MadeScene:
    """A scene as it goes to disk: its line and its PNG files by kind."""

    index: int
    line: bytes
    images: dict[str, bytes]


class IndexEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Line of the index: SHA-256 of a scene's line and images; `dataset` is the fingerprint."""

    index: int
    dataset: str
    record: str
    color: str
    depth: str
    instances: str


@dataclass(frozen=True)
class Fault:
    """Something that is wrong in a dataset.

    Attributes:
        file: The broken file, relative to the dataset, with the line where it has lines.
        words: What is wrong with it.
        index: The scene that must be made again; -1 if it is not one scene.
    """

    file: str
    words: str
    index: int = -1

    def __str__(self) -> str:
        return f"{self.file}: {self.words}"


@dataclass(frozen=True)
class Examination:
    """What was found on disk.

    Attributes:
        whole: By number of the scene its lines in `scenes.jsonl` and `index.jsonl`.
        faults: What is broken; a scene of which nothing is there is not among them.
        fingerprints: Of the metadata with which scenes were made.
    """

    whole: dict[int, tuple[bytes, bytes]]
    faults: list[Fault]
    fingerprints: set[str]


Line = TypeVar("Line", SceneRecord, IndexEntry)


class DatasetFolder:
    """The folder of a dataset, which need not be there yet."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.metadata = path / "metadata.json"
        self.records = path / "scenes.jsonl"
        self.index = path / "index.jsonl"

    def image(self, kind: str, index: int) -> Path:
        """Path of an image."""
        return self.path / kind / f"{index:06d}.png"

    def read_metadata(self) -> Metadata:
        """What the dataset is.

        Raises:
            DatasetError: If there is no dataset, it is of another version, or it is damaged.
        """
        try:
            return msgspec.json.decode(self.metadata.read_bytes(), type=Metadata)
        except FileNotFoundError as error:
            raise DatasetError(
                f"'{self.path}' is not a dataset: it has no metadata.json; make one with "
                f"`scenesense dataset generate {self.path}`"
            ) from error
        except OSError as error:
            raise DatasetError(f"'{self.metadata}' cannot be read: {error.strerror}") from error
        except (msgspec.MsgspecError, UnicodeError) as error:
            raise DatasetError(
                f"'{self.metadata}' is damaged or of another release: {error}; delete this file "
                "and generate the dataset again with the same options, which keeps its scenes"
            ) from error

    def read_image(self, kind: str, index: int) -> bytes:
        """A PNG file.

        Raises:
            DatasetError: If it cannot be read.
        """
        return self._read(self.image(kind, index))

    def read_lines(self, path: Path) -> list[bytes]:
        """The lines of a file that has them, without their ends; none if there is no file.

        Raises:
            DatasetError: If it cannot be read.
        """
        lines = self._read(path).split(b"\n") if path.exists() else []
        return lines[:-1] if lines and not lines[-1] else lines

    def write(self, path: Path, content: bytes) -> None:
        """Writes a file so that nobody ever sees half of it under its name.

        Raises:
            DatasetError: If it cannot be written, e.g. because the disk is full.
        """
        # A killed run may leave this one behind; the next writes the same file again.
        part = path.with_name(path.name + ".part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(content)
            part.replace(path)
        except OSError as error:
            raise self._unwritable(path, error) from error

    def write_lines(self, whole: Mapping[int, tuple[bytes, bytes]]) -> None:
        """Writes the lines of all whole scenes anew, in order."""
        for path, column in ((self.index, 1), (self.records, 0)):
            self.write(path, _joined(whole[index][column] for index in sorted(whole)))

    def append(self, made: MadeScene, dataset: str) -> tuple[bytes, bytes]:
        """Writes a scene: images, record, and last its line in the index.

        Returns:
            Its two lines.

        Raises:
            DatasetError: If a file cannot be written.
        """
        for kind in KINDS:
            self.write(self.image(kind, made.index), made.images[kind])
        entry = IndexEntry(
            index=made.index,
            dataset=dataset,
            record=checksum(made.line),
            **{kind: checksum(made.images[kind]) for kind in KINDS},
        )
        lines = (made.line, msgspec.json.encode(entry))
        for path, line in zip((self.records, self.index), lines, strict=True):
            try:
                with path.open("ab") as file:
                    file.write(line + b"\n")
            except OSError as error:
                raise self._unwritable(path, error) from error
        return lines

    def examine(self) -> Examination:
        """Reads everything and compares it with the index.

        Raises:
            DatasetError: If a file is there and cannot be read.
        """
        faults: list[Fault] = []
        entries = dict(self._decoded(self.index, IndexEntry, faults))
        records = dict(self._decoded(self.records, SceneRecord, faults))
        damaged = {fault.index for fault in faults}
        whole = {}
        for index in sorted({*entries, *records}):
            found = list(self._scene_faults(index, entries.get(index), records.get(index)))
            if index not in damaged:
                faults += found
            if not found:
                whole[index] = (records[index][0], entries[index][0])
        return Examination(whole, faults, {entry.dataset for _, entry in entries.values()})

    def has_lines_of(self, whole: Mapping[int, tuple[bytes, bytes]]) -> bool:
        """Whether both files hold exactly the lines of these scenes, in order."""
        return all(
            (path.read_bytes() if path.exists() else b"")
            == _joined(whole[index][column] for index in sorted(whole))
            for path, column in ((self.records, 0), (self.index, 1))
        )

    def _decoded(
        self, path: Path, kind: type[Line], faults: list[Fault]
    ) -> Iterator[tuple[int, tuple[bytes, Line]]]:
        """By number of the scene the lines of a file that can be read, and what they say."""
        decoder = msgspec.json.Decoder(kind)
        for number, line in enumerate(self.read_lines(path)):
            try:
                content = decoder.decode(line)
            except (msgspec.MsgspecError, UnicodeError) as error:
                name = f"{path.name} line {number + 1}"
                # Where no line is lost, scenes stand in order.
                faults.append(Fault(name, f"is damaged: {error}", number))
                continue
            yield content.index, (line, content)

    def _scene_faults(
        self,
        index: int,
        entry: tuple[bytes, IndexEntry] | None,
        record: tuple[bytes, SceneRecord] | None,
    ) -> Iterator[Fault]:
        if entry is None:
            yield Fault(self.index.name, f"does not have scene {index}", index)
            return
        if record is None:
            yield Fault(self.records.name, f"does not have scene {index}", index)
        elif checksum(record[0]) != entry[1].record:
            name = f"{self.records.name} scene {index}"
            yield Fault(name, "is not as it was written", index)
        for kind in KINDS:
            path = self.image(kind, index)
            name = str(path.relative_to(self.path))
            if not path.exists():
                yield Fault(name, "is missing", index)
            elif checksum(self._read(path)) != getattr(entry[1], kind):
                yield Fault(name, "is not as it was written", index)

    def _read(self, path: Path) -> bytes:
        try:
            return path.read_bytes()
        except OSError as error:
            raise DatasetError(f"'{path}' cannot be read: {error.strerror}") from error

    def _unwritable(self, path: Path, error: OSError) -> DatasetError:
        return DatasetError(
            f"'{path}' cannot be written: {os.strerror(error.errno or 0)}; the finished scenes are "
            "kept: see to it and run the same command again"
        )


def checksum(content: bytes) -> str:
    """SHA-256 as hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def _joined(lines: Iterable[bytes]) -> bytes:
    return b"".join(line + b"\n" for line in lines)
