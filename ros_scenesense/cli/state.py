"""What the nodes remember: show, export, take over, empty and examine a state folder."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from ros_scenesense.cli.console import plain_console
from ros_scenesense.cli.launch import add_state_argument
from ros_scenesense.errors import ParameterError, StateError
from ros_scenesense.nodes.registry import NODES

_EPILOG = """\
show, export and check read, also while the graph runs: an export is a copy of every file at one
moment each. import and reset want the graph to be stopped, and set what was there aside in a folder
of the state folder. Exit code: 0, 2 for a wrong value, 1 for any other error and where check finds
something damaged or newer.
"""
_SHOWN = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares `scenesense state show|export|import|reset|check`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    for name, words in (
        ("show", "what is remembered, and what was learned when"),
        ("export", "write it into one file"),
        ("import", "take it over from such a file"),
        ("reset", "let nodes begin afresh"),
        ("check", "examine the files"),
    ):
        action = actions.add_parser(name, help=words, description=words)
        if name == "show":
            action.add_argument(
                "--history",
                type=int,
                metavar="N",
                default=_SHOWN,
                help="so much of what was learned last; 0 = all (default: %(default)s)",
            )
            action.add_argument("--json", action="store_true", help="print it as JSON")
        elif name in ("export", "import"):
            action.add_argument("file", type=Path, metavar="FILE", help="the file, e.g. state.zip")
        elif name == "reset":
            action.add_argument(
                "nodes", nargs="*", metavar="NODE", help="only these (default: all)"
            )
        add_state_argument(action)


def run(arguments: argparse.Namespace) -> int:
    """Does what was asked."""
    console = plain_console()
    folder = arguments.state.expanduser()
    if arguments.action in ("show", "export", "check") and not folder.is_dir():
        raise StateError(f"there is no state folder {folder}: nodes that ran with it would make it")
    commands = {
        "show": _show,
        "export": _export,
        "import": _import,
        "reset": _reset,
        "check": _check,
    }
    return commands[arguments.action](arguments, folder, console)


def _show(arguments: argparse.Namespace, folder: Path, console: Console) -> int:
    from ros_scenesense.stages.state_catalogue import STATE_FILES
    from ros_scenesense.stages.state_history import contents, history

    if arguments.history < 0:
        raise ParameterError(f"--history is {arguments.history}, must be at least 0")
    there = [name for name in STATE_FILES if (folder / name).is_file()]
    holds = {name: contents(folder, name) for name in there}
    learned = history(folder)
    if arguments.json:
        told = {"files": holds, "history": [asdict(each) for each in learned]}
        print(json.dumps(told, indent=2))
        return 0
    table = Table(box=box.SIMPLE_HEAD, show_edge=False)
    for column in ("node", "file", "remembers", "holds"):
        table.add_column(column)
    for name in there:
        file = STATE_FILES[name]
        table.add_row(file.node, name, file.purpose, holds[name])
    console.print(table)
    shown = learned[-arguments.history :] if arguments.history else learned
    console.print(
        f"what was learned, {len(shown)} of {len(learned)}:"
        if learned
        else "nothing was learned yet"
    )
    for each in shown:
        console.print(_printable(f"{_time(each.stamp_ns)}  {each.node}: {each.words}"))
    return 0


def _export(arguments: argparse.Namespace, folder: Path, console: Console) -> int:
    from ros_scenesense.stages.state_archive import export_state

    manifest = export_state(folder, arguments.file)
    console.print(f"{arguments.file}: {', '.join(manifest.files) or 'nothing is remembered'}")
    return 0


def _import(arguments: argparse.Namespace, folder: Path, console: Console) -> int:
    from ros_scenesense.stages.state_folder import import_state

    manifest, aside = import_state(arguments.file, folder)
    console.print(f"{folder}: {', '.join(manifest.files) or 'nothing'}, of {manifest.created}")
    if aside is not None:
        console.print(f"what was there is in {aside}")
    return 0


def _reset(arguments: argparse.Namespace, folder: Path, console: Console) -> int:
    from ros_scenesense.stages.state_folder import reset_state

    for node in arguments.nodes:
        if node not in NODES:
            raise ParameterError(f"node '{node}' is unknown, known are: {', '.join(NODES)}")
    names, aside = reset_state(folder, arguments.nodes)
    if aside is None:
        console.print(f"nothing is remembered in {folder}")
    else:
        console.print(
            f"{', '.join(names)} of {folder} {'are' if names[1:] else 'is'} now in {aside}"
        )
    return 0


def _check(_arguments: argparse.Namespace, folder: Path, console: Console) -> int:
    from ros_scenesense.stages.state_folder import Condition, check_state

    bad = (Condition.DAMAGED, Condition.NEWER)
    findings = check_state(folder)
    for finding in findings:
        held = f", node '{finding.file.node}' runs with it" if finding.held else ""
        console.print(
            _printable(
                f"{finding.condition.value:8} {finding.file.name:20} {finding.words}{held}"
            ).rstrip()
        )
    for broken in sorted(folder.glob("*.broken-*")):
        console.print(f"broken   {broken.name}: set aside by its node")
    return 1 if any(finding.condition in bad for finding in findings) else 0


def _time(stamp_ns: int) -> str:
    if not stamp_ns:
        return f"{'unknown':19}"
    return f"{datetime.fromtimestamp(stamp_ns / 1e9, UTC):%Y-%m-%d %H:%M:%S}"


def _printable(text: str) -> str:
    return "".join(one if one.isprintable() else "?" for one in text)
