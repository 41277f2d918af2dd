"""Makes, verifies, counts and shows datasets of simulated scenes."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table as RichTable
from rich.text import Text

from ros_scenesense.cli.console import console_of
from ros_scenesense.cli.declared import add_declared, given
from ros_scenesense.errors import ParameterError
from ros_scenesense.parameters import Parameter, build, parameters_of
from ros_scenesense.simulation.backgrounds import MOST_BACKGROUNDS
from ros_scenesense.simulation.dataset.metadata import DatasetOptions, describe
from ros_scenesense.simulation.engine import SimulationConfiguration

_EPILOG = """\
A run that was interrupted goes on where it was when the same command is given again; what is
broken is made anew. A finished dataset has the same bytes for the same options and versions,
whatever the number of jobs. See docs/datasets.md for the format and the meaning of the labels.
"""
_MOST_FAULTS = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense dataset`."""
    parser.epilog = _EPILOG
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    command = _action(actions, "generate", "make a dataset, or what is missing of it", _generate)
    command.add_argument("path", type=Path, metavar="OUT", help="folder of the dataset")
    add_declared(command, _parameters())
    workers = command.add_mutually_exclusive_group()
    _add_jobs(workers)
    workers.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="use the workers of a Dask cluster; of its scheduler, e.g. tcp://host:8786",
    )
    command = _action(
        actions,
        "rebackground",
        "show the scenes of a dataset before other backgrounds",
        _rebackground,
    )
    command.add_argument("source", type=Path, metavar="SOURCE", help="folder of the dataset")
    command.add_argument("path", type=Path, metavar="OUT", help="folder of the new dataset")
    command.add_argument(
        "--backgrounds",
        type=int,
        metavar="INT",
        required=True,
        help=f"how many there are, each scene draws one (0 to {MOST_BACKGROUNDS}; 0 = plain)",
    )
    _add_jobs(command)
    command = _action(actions, "verify", "compare all files with their checksums", _verify)
    command.add_argument("path", type=Path, metavar="DIR", help="folder of the dataset")
    command = _action(actions, "stats", "count labels, and test the axioms in physics", _stats)
    command.add_argument("path", type=Path, metavar="DIR", help="folder of the dataset")
    command.add_argument(
        "--json", type=Path, metavar="FILE", help="write the figures as JSON, and beside it as .md"
    )
    command.add_argument(
        "--relabel",
        type=int,
        metavar="INT",
        default=200,
        help="label this many scenes once more, to see how many labels stay (default: %(default)s)",
    )
    command = _action(actions, "show", "draw scenes with their labels on one sheet", _show)
    command.add_argument("path", type=Path, metavar="DIR", help="folder of the dataset")
    command.add_argument(
        "--out", type=Path, metavar="FILE", required=True, help="the sheet, a PNG file"
    )
    command.add_argument(
        "--scenes", type=int, metavar="INT", default=20, help="how many (default: %(default)s)"
    )
    command.add_argument("--arrangement", metavar="STR", help="only scenes of this arrangement")


def run(arguments: argparse.Namespace) -> int:
    """Does what was asked for; returns 0, or 1 if `verify` found something broken."""
    action: Callable[[argparse.Namespace], int] = arguments.action_run
    return action(arguments)


def _action(
    actions: argparse._SubParsersAction[argparse.ArgumentParser],
    name: str,
    words: str,
    function: Callable[[argparse.Namespace], int],
) -> argparse.ArgumentParser:
    command = actions.add_parser(name, help=words, description=words)
    command.set_defaults(action_run=function)
    return command


def _parameters() -> list[Parameter]:
    return parameters_of(DatasetOptions) + parameters_of(SimulationConfiguration)


def _generate(arguments: argparse.Namespace) -> int:
    from ros_scenesense.simulation.dataset.generation import generate

    options = build(DatasetOptions, given(arguments, parameters_of(DatasetOptions)))
    configuration = build(
        SimulationConfiguration, given(arguments, parameters_of(SimulationConfiguration))
    )
    jobs = _jobs(arguments)
    metadata = describe(configuration, options)
    with _progress("scenes") as report:
        made = generate(arguments.path, metadata, jobs, report, arguments.cluster)
    print(f"{arguments.path}: {metadata.count} scenes, {made} of them made now")
    return 0


_MOST_JOBS = 256


def _add_jobs(parser: argparse._ActionsContainer) -> None:
    parser.add_argument(
        "--jobs", type=int, metavar="INT", help="worker processes (default: one per core)"
    )


def _jobs(arguments: argparse.Namespace) -> int:
    jobs = arguments.jobs if arguments.jobs is not None else len(os.sched_getaffinity(0))
    if not 1 <= jobs <= _MOST_JOBS:
        raise ParameterError(f"--jobs is {jobs}, must be an integer from 1 to {_MOST_JOBS}")
    return int(jobs)


def _rebackground(arguments: argparse.Namespace) -> int:
    from ros_scenesense.simulation.dataset.rebackground import rebackground

    jobs = _jobs(arguments)
    with _progress("scenes") as report:
        made = rebackground(arguments.source, arguments.path, arguments.backgrounds, jobs, report)
    print(f"{arguments.path}: the scenes of {arguments.source}, {made} of them made now")
    return 0


def _verify(arguments: argparse.Namespace) -> int:
    from ros_scenesense.simulation.dataset.verification import verify

    faults = verify(arguments.path)
    for fault in faults[:_MOST_FAULTS]:
        print(fault, file=sys.stderr)
    if len(faults) > _MOST_FAULTS:
        print(f"... and {len(faults) - _MOST_FAULTS} more", file=sys.stderr)
    if faults:
        print(
            f"scenesense dataset: '{arguments.path}' is broken in {len(faults)} places: generate "
            "it again with the same options, which mends them",
            file=sys.stderr,
        )
        return 1
    print(f"{arguments.path}: every file is as it was written")
    return 0


def _stats(arguments: argparse.Namespace) -> int:
    from ros_scenesense.provenance import machine, versions
    from ros_scenesense.results import Result, Table, text_of, write_result
    from ros_scenesense.simulation.dataset.agreement import label_agreement
    from ros_scenesense.simulation.dataset.reader import DatasetReader, spread_evenly
    from ros_scenesense.simulation.dataset.statistics import statistics

    if arguments.relabel < 0:
        raise ParameterError(f"--relabel is {arguments.relabel}, must be an integer of at least 0")
    if arguments.json is not None and arguments.json.suffix != ".json":
        raise ParameterError(f"--json is '{arguments.json}', must be a file that ends in .json")
    reader = DatasetReader(arguments.path)
    found = statistics(reader.records())
    figures = dict(found.figures)
    chosen = spread_evenly(reader, arguments.relabel) if arguments.relabel else []
    again = label_agreement((reader.record(index) for index in chosen), reader.metadata.seed)
    if again.share is not None:
        figures["label_agreement"] = round(again.share, 4)
    console = console_of(120)
    for title, (columns, rows) in found.tables.items():
        table = RichTable(*columns, title=title, title_justify="left")
        for row in rows:
            table.add_row(*(text_of(cell) for cell in row))
        console.print(table)
    if again.share is not None:
        console.print(
            f"Labelled once more: {again.share:.4f} of {again.kept} stability labels stay the same "
            f"(ambiguous either time: {again.objects - again.kept})"
        )
    if arguments.json is not None:
        result = Result(
            name="dataset",
            command=shlex.join(["scenesense", *sys.argv[1:]]),
            seed=reader.metadata.seed,
            versions=versions() | reader.metadata.versions,
            machine=machine(),
            figures=figures,
            tables={
                title: Table(columns=columns, rows=rows)
                for title, (columns, rows) in found.tables.items()
            },
        )
        write_result(result, arguments.json)
    return 0


def _show(arguments: argparse.Namespace) -> int:
    from ros_scenesense.demo.annotation import write_picture
    from ros_scenesense.demo.sheet import draw_sheet
    from ros_scenesense.simulation.dataset.reader import DatasetReader, spread_evenly

    if not 1 <= arguments.scenes <= _MOST_SHOWN:
        raise ParameterError(
            f"--scenes is {arguments.scenes}, must be an integer from 1 to {_MOST_SHOWN}"
        )
    reader = DatasetReader(arguments.path)
    chosen = spread_evenly(reader, arguments.scenes, arguments.arrangement)
    write_picture(draw_sheet(reader, chosen), arguments.out)
    print(f"{arguments.out}: {len(chosen)} scenes")
    return 0


_MOST_SHOWN = 400


class _Rate(ProgressColumn):
    """Scenes per second since this run began."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.1f}/s" if task.speed else "-/s")


@contextmanager
def _progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar with rate and time left, where somebody looks; a line now and then elsewhere."""
    console = Console(stderr=True)
    with Progress(
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TimeRemainingColumn(),
        console=console,
        speed_estimate_period=60.0,
    ) as progress:
        task = progress.add_task(what, total=None)

        def report(done: int, count: int) -> None:
            # What an earlier run made counts as done, but not for the rate.
            if progress.tasks[0].total is None:
                progress.reset(task, total=count, completed=done)
            progress.update(task, completed=done)

        yield report
