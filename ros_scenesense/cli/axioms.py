"""Learned axioms: what they say, how strong they are, what became of them; pin, veto, accept."""

from __future__ import annotations

import argparse
import time
import uuid
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from ros_scenesense.cli.console import plain_console
from ros_scenesense.cli.launch import add_domain_arguments, add_state_argument, add_timeout_argument
from ros_scenesense.errors import ParameterError
from ros_scenesense.stages.learner_store import (
    Event,
    LearnerContents,
    Outcome,
    StoredAxiom,
    look_into,
)

_EPILOG = """\
list, show and history read the state file, also while the graph runs. pin, veto and accept talk to
the running node; where none runs, give --offline, which changes the state file itself. Exit code:
0, 3 when a request is refused, 2 for a wrong value, 1 for any other error.
"""
_REFUSED = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares `scenesense axioms list|show|pin|veto|accept|history`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    for name, words in (
        ("list", "the axioms in force with their strength"),
        ("show", "one axiom as it can be written into a domain"),
        ("history", "what became of one axiom, or of all, cycle by cycle"),
    ):
        action = actions.add_parser(name, help=words, description=words)
        if name != "list":
            count = None if name == "show" else "?"
            action.add_argument("axiom", metavar="ID", nargs=count, help="id of the axiom")
        add_state_argument(action)
        if name == "list":
            action.add_argument("--all", action="store_true", help="also those of before")
    for name, words in (
        ("pin", "never forget this axiom"),
        ("veto", "put this axiom out of force and never learn it again"),
        ("accept", "put it (back) into force, also a given one that was refuted"),
    ):
        action = actions.add_parser(name, help=words, description=words)
        action.add_argument("axiom", metavar="ID", help="id of the axiom")
        action.add_argument("--offline", action="store_true", help="no graph runs")
        add_state_argument(action)
        add_domain_arguments(action)
        add_timeout_argument(action)


def run(arguments: argparse.Namespace) -> int:
    """Prints what was asked, or passes a request on."""
    console = plain_console()
    if arguments.action in ("pin", "veto", "accept"):
        outcome, reason = _request(arguments)
        console.print(_printable(f"{outcome}: {reason}"))
        return _REFUSED if outcome == "refused" else 0
    contents = look_into(_file(arguments))
    if arguments.action == "list":
        _list(contents, arguments.all, console)
    elif arguments.action == "show":
        axiom = _known(contents, arguments.axiom)
        console.print(f"{axiom.id}: {axiom.text}")
        console.print(
            f"% {axiom.kind}, {axiom.state}{', pinned' if axiom.pinned else ''}; true of "
            f"{axiom.purity:.1%} of the {axiom.support:.1%} of labelled objects that it speaks of; "
            f"learned in cycle {axiom.born} of {contents.cycle}, strength "
            f"{axiom.strength.value:.2f}"
        )
    else:
        events = [e for e in contents.history if arguments.axiom in (None, e.axiom)]
        if not events:
            _known(contents, arguments.axiom or "")
        _history(events, console)
    return 0


def _request(arguments: argparse.Namespace) -> tuple[Outcome, str]:
    # Imports ROS: not for `--help`.
    from ros_scenesense.messages.learning import AxiomRequest, AxiomResult

    request = AxiomRequest(
        id=f"command-{uuid.uuid4().hex}", axiom=arguments.axiom, request=arguments.action
    )
    if arguments.offline:
        from ros_scenesense.stages.axiom_keeper import apply_request

        return apply_request(_file(arguments), request, time.time_ns())
    from ros_scenesense.cli.conversation import ask

    result = ask(arguments, request, AxiomResult, lambda answer: answer.id == request.id)
    return result.outcome, result.reason


def _list(contents: LearnerContents, everything: bool, console: Console) -> None:
    table = Table(box=box.SIMPLE_HEAD, show_edge=False)
    for column in ("id", "state", "strength", "purity", "support", "cycles", "axiom"):
        table.add_column(column, justify="left" if column in ("id", "state", "axiom") else "right")
    for each in contents.axioms:
        if everything or each.state == "active":
            active = each.state == "active"
            table.add_row(
                each.id,
                "pinned" if each.pinned else each.state,
                f"{each.strength.value:.2f}" if active else "-",
                f"{each.purity:.3f}",
                f"{each.support:.3f}",
                str(contents.cycle - each.born),
                _printable(each.text),
            )
    console.print(table)
    for axiom, words in contents.refuted.items():
        console.print(_printable(f"given axiom {axiom} is out of force: {words}"))
    console.print(f"{contents.cycle} cycles, {contents.scenes} labelled scenes")


def _history(events: list[Event], console: Console) -> None:
    table = Table(box=box.SIMPLE_HEAD, show_edge=False)
    for column in ("cycle", "axiom", "what", "strength", "why"):
        table.add_column(column, justify="right" if column in ("cycle", "strength") else "left")
    for each in events:
        words = (each.axiom, each.what, f"{each.strength:.2f}", each.words)
        table.add_row(str(each.cycle), *map(_printable, words))
    console.print(table)


def _known(contents: LearnerContents, name: str) -> StoredAxiom:
    found = next((each for each in contents.axioms if each.id == name), None)
    if found is None:
        names = ", ".join(each.id for each in contents.axioms) or "none"
        raise ParameterError(f"there is no learned axiom {name!r}; known: {names}")
    return found


def _file(arguments: argparse.Namespace) -> Path:
    state: Path = arguments.state
    return state.expanduser() / "learner.db"


def _printable(text: str) -> str:
    return "".join(one if one.isprintable() else "?" for one in text)
