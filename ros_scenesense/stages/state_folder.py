"""A state folder while no node runs with it: taken over from an archive, emptied, examined.

What is replaced or emptied is set aside in a folder beside it, never deleted.
"""

from __future__ import annotations

import shutil
import sqlite3
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import Enum
from pathlib import Path

from ros_scenesense.errors import StateError
from ros_scenesense.stages.state_archive import (
    Manifest,
    file_version,
    read_manifest,
    unpack,
)
from ros_scenesense.stages.state_catalogue import NETWORKS, STATE_FILES, StateFile

_STAGING = ".import"
_LOGS = ("-wal", "-shm", "-journal")
# The ids of evidence that one gives the other has applied: together or not at all.
_TOGETHER = ("grounding.db", "control.db")


class Condition(Enum):
    """What `check_state` finds a file to be."""

    SOUND = "sound"
    ABSENT = "absent"
    OLDER = "older"  # lifted when its node starts
    NEWER = "newer"  # refused by its node
    DAMAGED = "damaged"  # set aside when its node starts


@dataclass(frozen=True)
class Finding:
    """What was found of a state file."""

    file: StateFile
    condition: Condition
    words: str
    held: bool = False


def import_state(source: Path, folder: Path) -> tuple[Manifest, Path | None]:
    """Replaces the state in a folder by that of an archive.

    Everything is unpacked and checked before anything is replaced.

    Args:
        source: The archive.
        folder: The state folder.

    Returns:
        What the archive holds; where the state of before is now, None if there was none.

    Raises:
        StateError: If the archive is damaged or of a newer release, if a node runs with the
            folder, or if it cannot be written.
    """
    staging = folder / _STAGING
    try:
        folder.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(staging, ignore_errors=True)
        staging.mkdir()
        with _archive(source) as archive:
            manifest = read_manifest(archive, source)
            unpack(archive, manifest, source, staging)
        with exclusive(folder, STATE_FILES):
            aside = _set_aside(folder, STATE_FILES)
            for name in manifest.files:
                (folder / name).parent.mkdir(exist_ok=True)
                (staging / name).replace(folder / name)
    except OSError as error:
        raise StateError(f"{source} cannot be taken over into {folder}: {error}") from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    return manifest, aside


def reset_state(folder: Path, nodes: Iterable[str] = ()) -> tuple[list[str], Path | None]:
    """Lets nodes begin afresh.

    Args:
        folder: The state folder.
        nodes: Which; none = all. Grounding and its control go together, whichever is named.

    Returns:
        The names of the files, and where they are now, None if there were none.

    Raises:
        StateError: If a node runs with the folder, or it cannot be written.
    """
    wanted = set(nodes)
    names = [name for name, file in STATE_FILES.items() if not wanted or file.node in wanted]
    if set(_TOGETHER) & set(names):
        names = [name for name in STATE_FILES if name in {*names, *_TOGETHER}]
    there = [name for name in names if (folder / name).exists()]
    try:
        with exclusive(folder, there):
            return there, _set_aside(folder, names)
    except OSError as error:
        raise StateError(f"{folder} cannot be written: {error}") from error


def check_state(folder: Path) -> list[Finding]:
    """Examines every state file; changes nothing, also while nodes run."""
    return [_examined(folder, file) for file in STATE_FILES.values()]


@contextmanager
def exclusive(folder: Path, names: Iterable[str]) -> Iterator[None]:
    """Holds state files, so that no node can open them.

    Raises:
        StateError: If a node holds one of them.
    """
    with ExitStack() as stack:
        for name in names:
            path = folder / name
            if not path.is_file():
                continue
            connection = stack.enter_context(
                closing(sqlite3.connect(path, timeout=0.0, isolation_level=None))
            )
            try:
                # SQLite lets nobody leave the write-ahead log while another has the file open.
                connection.execute("PRAGMA journal_mode=DELETE")
                connection.execute("BEGIN EXCLUSIVE")
            except sqlite3.OperationalError as error:
                raise StateError(
                    f"{path} is in use: node '{STATE_FILES[name].node}' runs with it; stop the "
                    "graph first"
                ) from error
            except sqlite3.DatabaseError:
                continue  # damaged: no node can hold it
        yield


def _set_aside(folder: Path, names: Iterable[str]) -> Path | None:
    """Moves files into a new folder beside them, with the networks if attention's is among them."""
    paths = [folder / name for name in names if (folder / name).exists()]
    if "attention.db" in names and (folder / NETWORKS).is_dir():
        paths.append(folder / NETWORKS)
    if not paths:
        return None
    stem, number = f"set_aside-{datetime.now(UTC):%Y%m%dT%H%M%S}", 1
    while (aside := folder / (stem if number == 1 else f"{stem}-{number}")).exists():
        number += 1
    aside.mkdir()
    for path in paths:
        path.replace(aside / path.name)
        for suffix in _LOGS:
            log = path.with_name(path.name + suffix)
            if log.exists():
                log.replace(aside / log.name)
    return aside


def _examined(folder: Path, file: StateFile) -> Finding:
    path = folder / file.name
    if not path.is_file():
        return Finding(file, Condition.ABSENT, "")
    try:
        version = file_version(path)
        if version > file.version:
            words = f"version {version}, this release reads up to {file.version}"
            return Finding(file, Condition.NEWER, words, _is_held(path))
        if version < file.version:
            words = f"version {version}, its node lifts it to {file.version}"
            return Finding(file, Condition.OLDER, words, _is_held(path))
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as opened:
            file.check(opened)
    except (StateError, sqlite3.Error) as error:
        return Finding(file, Condition.DAMAGED, str(error))
    # What was written last stands in the log.
    log = path.with_name(f"{path.name}-wal")
    kb = sum(each.stat().st_size for each in (path, log) if each.exists()) / 1000
    return Finding(file, Condition.SOUND, f"version {version}, {kb:.0f} kB", _is_held(path))


def _is_held(path: Path) -> bool:
    """Whether somebody has a state file open; changes nothing of it."""
    with closing(sqlite3.connect(path, timeout=0.0)) as connection:
        try:
            connection.execute("PRAGMA locking_mode=EXCLUSIVE")
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        except sqlite3.OperationalError:
            return True
    return False


@contextmanager
def _archive(source: Path) -> Iterator[zipfile.ZipFile]:
    try:
        archive = zipfile.ZipFile(source)
    except (OSError, zipfile.BadZipFile) as error:
        raise StateError(f"{source} is no state export: {error}") from error
    with archive:
        yield archive
