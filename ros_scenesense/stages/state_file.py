"""Opens the SQLite file in which a stage remembers: one file per stage, one writer, WAL.

A kill loses at most the transaction in flight. A file that is broken is set aside and reported,
never silently replaced; one of a newer release is refused.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from ros_scenesense.errors import StateError
from ros_scenesense.stages.health import Health

IN_MEMORY = Path(":memory:")


def state_path(folder: str, name: str) -> Path:
    """The state file of a stage in the folder of its parameter `state_dir`; empty = in memory."""
    return Path(folder).expanduser() / name if folder else IN_MEMORY


def open_state_file(
    path: Path,
    schema: str,
    version: int,
    health: Health,
    migrations: Sequence[str] = (),
    check: Callable[[sqlite3.Connection], object] = lambda _connection: None,
) -> sqlite3.Connection:
    """Opens or creates a state file.

    Args:
        path: The file, or `IN_MEMORY` for a state that nobody keeps.
        schema: SQL that creates the tables of an empty file.
        version: Version of that schema, kept in the file.
        health: Gets a problem if a broken file had to be set aside.
        migrations: SQL that lifts a file of the versions before by one each, the last of them to
            `version`; a file that is older than all of them is refused.
        check: Raises `sqlite3.DatabaseError` if the content is not what the stage wrote.

    Raises:
        StateError: If the folder cannot be written, or the file is of a version that is not read.
    """
    try:
        if path != IN_MEMORY:
            path.parent.mkdir(parents=True, exist_ok=True)
        return _open(path, schema, version, migrations, check)
    except sqlite3.DatabaseError as error:
        if isinstance(error, sqlite3.OperationalError) or path == IN_MEMORY:
            raise StateError(f"{path} cannot be opened: {error}") from error
        broken = _set_aside(path)
        health.problem(
            "state_set_aside", f"{path} is damaged ({error}): kept as {broken}, started afresh"
        )
        return _open(path, schema, version, migrations, check)
    except OSError as error:
        raise StateError(
            f"{path.parent} cannot be made: {error}; choose another state folder"
        ) from error


@contextmanager
def read_state_file(path: Path, version: int) -> Iterator[sqlite3.Connection]:
    """Looks into a state file without changing it, also while a node writes it.

    Args:
        path: The file.
        version: The schema version that is read.

    Raises:
        StateError: If there is no such file, or it cannot be read.
    """
    if not path.is_file():
        raise StateError(f"there is no {path}: it is written by nodes that run with this state")
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as opened:
            found = opened.execute("PRAGMA user_version").fetchone()[0]
            if found != version:
                raise StateError(f"{path} has schema version {found}, this release reads {version}")
            yield opened
    except sqlite3.DatabaseError as error:
        raise StateError(f"{path} cannot be read: {error}") from error


def _open(
    path: Path,
    schema: str,
    version: int,
    migrations: Sequence[str],
    check: Callable[[sqlite3.Connection], object],
) -> sqlite3.Connection:
    connection = sqlite3.connect(path, timeout=5.0)
    try:
        found = connection.execute("PRAGMA user_version").fetchone()[0]
        if found != 0 and not version - len(migrations) <= found <= version:
            raise StateError(f"{path} has schema version {found}, this release reads {version}")
        answer = connection.execute("PRAGMA quick_check").fetchone()[0]
        if answer != "ok":
            raise sqlite3.DatabaseError(answer)
        connection.execute("PRAGMA journal_mode=WAL")
        if found != version:
            steps = schema if found == 0 else " ".join(migrations[found - version :])
            connection.executescript(f"BEGIN; {steps} PRAGMA user_version={version}; COMMIT;")
        check(connection)
    except BaseException:
        connection.close()
        raise
    return connection


def _set_aside(path: Path) -> Path:
    number = 1
    while (broken := path.with_name(f"{path.name}.broken-{number}")).exists():
        number += 1
    path.rename(broken)
    for suffix in ("-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)
    return broken
