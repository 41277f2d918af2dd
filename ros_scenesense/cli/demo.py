"""Runs the whole graph on simulated scenes, shows it live, and writes a report.

`demo` shows scenes and what is decided of them; `demo trace` and `demo clutter` tell stories of
goals.
"""

from __future__ import annotations

import argparse
import dataclasses
import signal
import sys
from typing import Any, TypeVar

from rich.console import Console

from ros_scenesense.cli.console import console_of
from ros_scenesense.cli.launch import add_overrides_argument, parse_overrides
from ros_scenesense.demo.run import LEARNING_SCENES, Demo, DemoOptions, show_result
from ros_scenesense.demo.told import STORIES, StoryOptions, tell
from ros_scenesense.errors import ParameterError
from ros_scenesense.parameters import Parameter, build, parameters_of

_EPILOG = """\
`trace` plays the paper's first execution trace: the robot, which was shown 100 labelled scenes,
plans, is surprised, learns, and does better. `clutter` has it tidy up a table. Both write the
story into the report.

`--learn` starts without six axioms, and shows how they are learned from labelled scenes.
`-p reasoner.withheld=s1,s2,s3,o1,o2,o3` leaves out six axioms, so that most is left to the network;
`-p attention.network=none` leaves it all to reasoning.
"""
Options = TypeVar("Options", DemoOptions, StoryOptions)
_EXIT_CODES = {"complete": 0, "timed_out": 1, "failed": 1, "interrupted": 130}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds one option per parameter of the demo and its stories, `-p` for those of the nodes."""
    parser.add_argument(
        "story",
        nargs="?",
        choices=STORIES,
        help="a story of goals instead of single scenes",
    )
    for option in _options().values():
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
    signal.signal(signal.SIGTERM, _interrupt)
    console = _console()
    if arguments.story is not None:
        return tell(arguments.story, _chosen(StoryOptions, arguments), console)
    if arguments.learn and arguments.scenes is None:
        arguments.scenes = LEARNING_SCENES
    result = Demo(_chosen(DemoOptions, arguments), console).run()
    show_result(result, console)
    summary = result.summary
    if summary.error:
        print(f"scenesense demo: {summary.error}", file=sys.stderr)
    if summary.outcome == "complete" and summary.scenes == 0:
        print("scenesense demo: every scene was lost", file=sys.stderr)
        return 1
    return _EXIT_CODES[summary.outcome]


def _options() -> dict[str, Parameter]:
    """All options by name; those of the plain demo first."""
    options: dict[str, Parameter] = {}
    for option in (*parameters_of(DemoOptions), *parameters_of(StoryOptions)):
        options.setdefault(option.name, option)
    return options


def _chosen(configuration: type[Options], arguments: argparse.Namespace) -> Options:
    """What the user chose.

    Raises:
        ParameterError: If an option is not for what is run, or its value is wrong.
    """
    given = {name: getattr(arguments, name) for name in _options()}
    given = {name: value for name, value in given.items() if value is not None}
    known = {option.name for option in parameters_of(configuration)}
    for name in given.keys() - known:
        words = f"demo {arguments.story}" if arguments.story else "demo without a story"
        raise ParameterError(f"--{name.replace('_', '-')} is not for {words}")
    options = build(configuration, given)
    return dataclasses.replace(options, overrides=parse_overrides(arguments.overrides))


def _console() -> Console:
    reconfigure: Any = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        # A terminal that knows no check mark gets a question mark, not a traceback.
        reconfigure(errors="replace")
    return console_of(100)


def _interrupt(_signal: int, _frame: object) -> None:
    raise KeyboardInterrupt
