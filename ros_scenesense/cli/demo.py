"""Runs the whole graph on simulated scenes, shows it live, and writes a report."""

from __future__ import annotations

import argparse
import dataclasses
import signal
import sys
from typing import Any

from rich.console import Console

from ros_scenesense.cli.launch import add_overrides_argument, parse_overrides
from ros_scenesense.demo.run import Demo, DemoOptions, show_result
from ros_scenesense.parameters import build, parameters_of

_EPILOG = """\
`-p reasoner.withheld=s1,s2,s3,o1,o2,o3` leaves out six axioms, so that most is left to the network;
`-p attention.network=none` leaves it all to reasoning.
"""
_EXIT_CODES = {"complete": 0, "timed_out": 1, "failed": 1, "interrupted": 130}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds one option per parameter of `DemoOptions`, and `-p` for those of the nodes."""
    for option in parameters_of(DemoOptions):
        if option.type is bool:
            name = f"--{option.name}"
            parser.add_argument(name, action="store_true", default=None, help=option.description)
            continue
        known = option.default not in ("", -1)
        parser.add_argument(
            f"--{option.name.replace('_', '-')}",
            dest=option.name,
            metavar=option.type.__name__.upper(),
            help=f"{option.description} ({option.allowed}"
            + (f"; default {option.default})" if known else ")"),
        )
    add_overrides_argument(parser)
    parser.epilog = _EPILOG


def run(arguments: argparse.Namespace) -> int:
    """Runs the demo.

    Returns:
        0 if all scenes went through the graph, 130 if the user stopped it, else 1.
    """
    given = {option.name: getattr(arguments, option.name) for option in parameters_of(DemoOptions)}
    options = build(
        DemoOptions, {name: value for name, value in given.items() if value is not None}
    )
    options = dataclasses.replace(options, overrides=parse_overrides(arguments.overrides))
    console = _console()
    signal.signal(signal.SIGTERM, _interrupt)
    result = Demo(options, console).run()
    show_result(result, console)
    summary = result.summary
    if summary.error:
        print(f"scenesense demo: {summary.error}", file=sys.stderr)
    if summary.outcome == "complete" and summary.scenes == 0:
        print("scenesense demo: every scene was lost", file=sys.stderr)
        return 1
    return _EXIT_CODES[summary.outcome]


def _console() -> Console:
    reconfigure: Any = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        # A terminal that knows no check mark gets a question mark, not a traceback.
        reconfigure(errors="replace")
    console = Console()
    return console if console.is_terminal else Console(width=100)


def _interrupt(_signal: int, _frame: object) -> None:
    raise KeyboardInterrupt
