"""The state of a graph as one file: a zip with a copy of every state file, and a manifest.

A state file is copied as it is at one moment, also while its node writes it. The archive appears
whole or not at all.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sqlite3
import tempfile
import zipfile
from collections.abc import Iterable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath

import msgspec

import ros_scenesense
from ros_scenesense.errors import StateError
from ros_scenesense.stages.state_catalogue import NETWORKS, STATE_FILES

MANIFEST = "manifest.json"
_SCHEMA = "state_export/1"
_LARGEST_MANIFEST = 1_000_000


class ArchivedFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file of an archive: its size, SHA-256, and, of a state file, its schema version."""

    bytes: int
    sha256: str
    version: int | None = None


class Manifest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What an archive says of itself; `files` by path below the state folder."""

    schema: str
    scenesense_version: str
    created: str
    files: dict[str, ArchivedFile]


def export_state(state: Path, target: Path) -> Manifest:
    """Writes the state of a graph into one file.

    Args:
        state: The state folder; nodes may be running with it. Without one nothing is remembered.
        target: The file to write; one that exists is replaced.

    Raises:
        StateError: If a state file is damaged, or the archive cannot be written.
    """
    temporary = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
            files = dict(_copies(state, Path(scratch)))
            manifest = Manifest(
                schema=_SCHEMA,
                scenesense_version=ros_scenesense.__version__,
                created=f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
                files={name: _described(name, path) for name, path in files.items()},
            )
            with temporary.open("wb") as opened:
                with zipfile.ZipFile(opened, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
                    text = msgspec.json.format(msgspec.json.encode(manifest))
                    archive.writestr(MANIFEST, text)
                    for name, path in files.items():
                        archive.write(path, name)
                opened.flush()
                os.fsync(opened.fileno())
        temporary.replace(target)
    except OSError as error:
        raise StateError(f"{target} cannot be written: {error}") from error
    finally:
        temporary.unlink(missing_ok=True)
    return manifest


def read_manifest(archive: zipfile.ZipFile, source: Path) -> Manifest:
    """What an archive says of itself, checked: only files that this release can read.

    Raises:
        StateError: If it is no state export, or one of a newer release.
    """
    try:
        if archive.getinfo(MANIFEST).file_size > _LARGEST_MANIFEST:
            raise StateError(f"{source}: {MANIFEST} is too large to be one")
        manifest = msgspec.json.decode(archive.read(MANIFEST), type=Manifest)
    except (KeyError, zipfile.BadZipFile, msgspec.MsgspecError, OSError) as error:
        raise StateError(f"{source} is no state export: {error}") from error
    if manifest.schema != _SCHEMA:
        raise StateError(f"{source} is a {manifest.schema}, this release reads {_SCHEMA}")
    for name, file in manifest.files.items():
        _check_file(name, file, source)
    return manifest


def unpack(archive: zipfile.ZipFile, manifest: Manifest, source: Path, folder: Path) -> None:
    """Unpacks the files of an archive and checks every one of them.

    Raises:
        StateError: If one is damaged.
    """
    for name, file in manifest.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with archive.open(name) as packed, path.open("wb") as unpacked:
                left = file.bytes
                while block := packed.read(min(2**20, left + 1)):
                    left -= len(block)
                    if left < 0:
                        break
                    unpacked.write(block)
        except (KeyError, zipfile.BadZipFile, OSError) as error:
            raise StateError(f"{source}: {name} cannot be read: {error}") from error
        if left or _sha256(path) != file.sha256:
            raise StateError(f"{source}: {name} is damaged")
        if name in STATE_FILES and file_version(path) != file.version:
            raise StateError(f"{source}: {name} is not of version {file.version}")


def file_version(path: Path) -> int:
    """The schema version of a sound state file.

    Raises:
        StateError: If it is damaged.
    """
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as opened:
            answer = opened.execute("PRAGMA quick_check").fetchone()[0]
            if answer != "ok":
                raise sqlite3.DatabaseError(answer)
            return int(opened.execute("PRAGMA user_version").fetchone()[0])
    except sqlite3.Error as error:
        raise StateError(f"{path} is damaged: {error}") from error


def _copies(state: Path, scratch: Path) -> Iterable[tuple[str, Path]]:
    """Copies of the files of a state folder by their names, each of one moment."""
    for name in STATE_FILES:
        path = state / name
        if path.is_file():
            _copy_database(path, scratch / name)
            yield name, scratch / name
    (scratch / NETWORKS).mkdir()
    for path in sorted((state / NETWORKS).glob("*.pt")):
        # What a training keeps there while it is under way comes and goes.
        with contextlib.suppress(FileNotFoundError):
            yield f"{NETWORKS}/{path.name}", shutil.copyfile(path, scratch / NETWORKS / path.name)


def _copy_database(path: Path, copy: Path) -> None:
    try:
        source = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=5.0)
        with closing(source), closing(sqlite3.connect(copy)) as target:
            source.backup(target)
            # Of one file alone: without a log beside it.
            target.execute("PRAGMA journal_mode=DELETE")
    except sqlite3.Error as error:
        raise StateError(f"{path} cannot be copied: {error}") from error


def _described(name: str, path: Path) -> ArchivedFile:
    version = file_version(path) if name in STATE_FILES else None
    return ArchivedFile(path.stat().st_size, _sha256(path), version)


def _check_file(name: str, file: ArchivedFile, source: Path) -> None:
    path = PurePosixPath(name)
    if name in STATE_FILES:
        newest = STATE_FILES[name].version
        if file.version is None or not 0 < file.version <= newest:
            raise StateError(
                f"{source}: {name} has schema version {file.version}, this release reads up to "
                f"{newest}"
            )
    elif len(path.parts) != 2 or path.parts[0] != NETWORKS or path.suffix != ".pt" or "\\" in name:
        raise StateError(f"{source}: {name!r} is no file of a state folder")


def _sha256(path: Path) -> str:
    with path.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()
