"""Where the files of a run go."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from ros_scenesense.errors import ParameterError


def new_folder(started: datetime) -> Path:
    """A folder in `runs/` that does not exist yet, called by date and time."""
    name = f"{started:%Y%m%d-%H%M%S}"
    folder = Path("runs") / name
    number = 1
    while folder.exists():
        number += 1
        folder = folder.with_name(f"{name}-{number}")
    return folder


def make_folder(folder: Path) -> None:
    """Makes a run folder.

    Raises:
        ParameterError: If that cannot be done.
    """
    try:
        (folder / "logs").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ParameterError(f"run folder '{folder}' cannot be made: {error}") from error
