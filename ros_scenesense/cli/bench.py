"""Measures the figures that the documentation quotes, and prints them beside their targets."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table as TextTable
from rich.text import Text

from ros_scenesense.bench.figure import BenchOptions
from ros_scenesense.bench.suite import run_suite
from ros_scenesense.cli.console import console_of
from ros_scenesense.errors import ParameterError
from ros_scenesense.parameters import Parameter
from ros_scenesense.results import Result, Table, text_of, write_result

_SEED = Parameter("seed", int, 0, "seed of the simulated scenes", minimum=0)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds where to write, how long to measure, and the seed."""
    parser.add_argument(
        "--json", metavar="FILE", help="write the results there, and as Markdown beside it"
    )
    parser.add_argument("--quick", action="store_true", help="few samples: see that it runs")
    parser.add_argument("--seed", default=_SEED.default, help=f"{_SEED.description} (default 0)")


def run(arguments: argparse.Namespace) -> int:
    """Measures, prints, writes.

    Returns:
        0; a missed target is shown, not an error, since it depends on the machine.
    """
    seed = _SEED.check(arguments.seed)
    path = Path(arguments.json) if arguments.json is not None else None
    if path is not None and path.suffix != ".json":
        raise ParameterError(
            f"parameter 'json' is '{path}', must be a file name that ends in .json"
        )
    options = BenchOptions(seed=int(seed), quick=arguments.quick)
    console = console_of(140)
    result = run_suite(options, _command(options, path), console.print)
    show(result, console)
    if path is not None:
        write_result(result, path)
        console.print(f"written: {path} and {path.with_suffix('.md')}", soft_wrap=True)
    return 0


def show(result: Result, console: Console) -> None:
    """Prints all tables of a result."""
    for title, table in result.tables.items():
        console.print()
        console.print(_text_table(title, table))


def _text_table(title: str, table: Table) -> TextTable:
    text = TextTable(title=title, title_justify="left", box=box.SIMPLE_HEAD, show_edge=False)
    for index, column in enumerate(table.columns):
        numbers = any(isinstance(row[index], int | float) for row in table.rows)
        text.add_column(column, justify="right" if numbers else "left")
    for row in table.rows:
        text.add_row(*(Text(text_of(cell)) for cell in row))
    return text


def _command(options: BenchOptions, path: Path | None) -> str:
    words = ["scenesense", "bench"]
    if options.quick:
        words.append("--quick")
    if options.seed:
        words += ["--seed", str(options.seed)]
    if path is not None:
        words += ["--json", str(path)]
    return shlex.join(words)
