"""Results of experiments and benchmarks: one JSON file with a Markdown twin, and maybe a plot.

The names of figures are stable, for other tools read them; figures from the paper stand beside.
"""

from __future__ import annotations

import os
from pathlib import Path

import msgspec

from ros_scenesense.errors import SceneSenseError


class Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table for people; every row has as many cells as there are columns."""

    columns: list[str]
    rows: list[list[str | int | float | None]]


class Result(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What an experiment or benchmark found, and what it takes to find it again.

    `notes` are paragraphs of Markdown for people, in which a table or plot may be discussed.
    """

    name: str
    command: str
    seed: int
    versions: dict[str, str]
    machine: dict[str, str | int]
    figures: dict[str, float]
    paper: dict[str, float] = {}
    notes: list[str] = []
    tables: dict[str, Table] = {}


def write_result(result: Result, path: Path) -> None:
    """Writes the JSON file, and beside it the same as Markdown.

    Raises:
        SceneSenseError: If the files cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        content = msgspec.json.format(msgspec.json.encode(result), indent=2) + b"\n"
        write_atomically(path, content)
        write_atomically(path.with_suffix(".md"), markdown(result).encode())
    except OSError as error:
        raise SceneSenseError(f"result '{path}' cannot be written: {error}") from error


def read_result(path: Path) -> Result:
    """Reads the JSON file of a result.

    Raises:
        msgspec.ValidationError: If it does not follow the schema.
    """
    return msgspec.json.decode(path.read_bytes(), type=Result)


def write_atomically(path: Path, content: bytes) -> None:
    """Writes a file so that nobody ever sees half of it."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def markdown(result: Result) -> str:
    """The result as a page."""
    lines = [f"# {result.name}", "", f"`{result.command}`", ""]
    for note in result.notes:
        lines += [note, ""]
    for title, table in result.tables.items():
        lines += [f"## {title}", "", _row(table.columns), _row(["---"] * len(table.columns))]
        lines += [_row(row) for row in table.rows] + [""]
    versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    machine = ", ".join(f"{name}: {value}" for name, value in result.machine.items())
    lines += [f"Seed {result.seed}. {versions}.", "", f"Machine: {machine}.", ""]
    return "\n".join(lines)


def text_of(cell: str | int | float | None) -> str:
    """A cell as text: four significant digits are enough for a reader."""
    if cell is None:
        return "-"
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def _row(cells: list[str] | list[str | int | float | None]) -> str:
    return "| " + " | ".join(text_of(cell).replace("|", "\\|") for cell in cells) + " |"
