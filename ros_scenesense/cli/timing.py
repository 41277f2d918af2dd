"""How long the steps of the running graph take: median, 95th percentile, longest; as CSV too."""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TextIO

import numpy as np
from rich import box
from rich.table import Table

from ros_scenesense.cli.console import console_of
from ros_scenesense.cli.launch import add_domain_arguments
from ros_scenesense.errors import ParameterError, SceneSenseError

COLUMNS = ["stamp_s", "step", "milliseconds"]
_EPILOG = """\
A step is named by its node: grounding/relations, reasoner/classify. What ends in _job is done by
the node's worker; its time runs until the result is back, waiting included.
simulated_camera/round_trip is the time from showing a scene to its estimates. A CSV file has the
columns stamp_s (when it was heard, seconds since 1970), step and milliseconds. Exit code: 0, 2 for
a wrong value, 1 when nothing is heard.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense timing`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    parser.add_argument(
        "file",
        nargs="?",
        type=Path,
        metavar="FILE.csv",
        help="sum up this file instead of the running graph",
    )
    parser.add_argument(
        "--seconds",
        type=float,
        metavar="SECONDS",
        default=10.0,
        help="listen for so long; 0 = until Ctrl-C (default: %(default)g)",
    )
    parser.add_argument(
        "--csv", type=Path, metavar="FILE", help="write every time that is heard into this file"
    )
    add_domain_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Listens or reads, then prints the table."""
    console = console_of(120)
    if arguments.file is not None:
        if arguments.csv is not None:
            raise ParameterError("--csv writes what is heard: leave it out to read a file")
        console.print(summary_table(read_csv(arguments.file)))
        return 0
    if not (arguments.seconds >= 0.0 and math.isfinite(arguments.seconds)):
        raise ParameterError(f"--seconds is {arguments.seconds:g}, must be at least 0")
    # Imports ROS: not for `--help`.
    from ros_scenesense.cli.timing_listener import listen

    if arguments.csv is None:
        heard = list(listen(arguments))
    else:
        try:
            with arguments.csv.open("w", newline="") as file:
                heard = list(written(listen(arguments), file))
        except OSError as error:
            raise SceneSenseError(f"'{arguments.csv}' cannot be written: {error}") from error
    console.print(summary_table((step, milliseconds) for _, step, milliseconds in heard))
    return 0


def written(
    heard: Iterable[tuple[float, str, float]], file: TextIO
) -> Iterator[tuple[float, str, float]]:
    """Passes on what is heard, and writes it with a line of column names before."""
    writer = csv.writer(file)
    writer.writerow(COLUMNS)
    for stamp_s, step, milliseconds in heard:
        writer.writerow([f"{stamp_s:.6f}", step, f"{milliseconds:.6g}"])
        yield stamp_s, step, milliseconds


def read_csv(path: Path) -> list[tuple[str, float]]:
    """The steps of a CSV file with their milliseconds.

    Raises:
        SceneSenseError: If it cannot be read, or is no such file; the text names the line.
    """
    try:
        with path.open(newline="") as file:
            lines = list(csv.reader(file))
    except (OSError, UnicodeError, csv.Error) as error:
        raise SceneSenseError(f"'{path}' cannot be read: {error}") from error
    if not lines or lines[0] != COLUMNS:
        raise SceneSenseError(f"{path}:1: the first line must be {','.join(COLUMNS)}")
    return [_read_line(path, number, cells) for number, cells in enumerate(lines[1:], 2)]


def summary_table(steps: Iterable[tuple[str, float]]) -> Table:
    """How often each step was heard, and how long it took."""
    by_step: dict[str, list[float]] = {}
    for step, milliseconds in steps:
        by_step.setdefault(step, []).append(milliseconds)
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("step")
    for title in ("count", "median ms", "95 % ms", "longest ms"):
        table.add_column(title, justify="right")
    for step in sorted(by_step):
        values = by_step[step]
        percentiles = np.percentile(values, [50.0, 95.0, 100.0])
        table.add_row(_printable(step), str(len(values)), *(f"{each:.2f}" for each in percentiles))
    return table


def _read_line(path: Path, number: int, cells: list[str]) -> tuple[str, float]:
    try:
        _, step, milliseconds = cells
        value = float(milliseconds)
        if not math.isfinite(value):
            raise ValueError(milliseconds)
    except ValueError:
        words = f"{path}:{number}: must hold {', '.join(COLUMNS)}, has {','.join(cells)!r}"
        raise SceneSenseError(words) from None
    return step, value


def _printable(text: str) -> str:
    return "".join(each if each.isprintable() else "?" for each in text)
