"""Runs an experiment of the paper, prints its tables, and writes them with a plot."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from pathlib import Path

from rich.console import Console

from ros_scenesense.errors import ParameterError
from ros_scenesense.parameters import Parameter

_EPILOG = """\
Figures of a full run are in docs/results/, with the command that made them.
"""
_SEED = Parameter("seed", int, 0, "seed of all that is drawn", minimum=0, maximum=2**53 - 1)
_JOBS = Parameter("jobs", int, 0, "worker processes; 0 = one per core", minimum=0, maximum=1024)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the experiments and their arguments."""
    parser.epilog = _EPILOG
    experiments = parser.add_subparsers(dest="experiment", metavar="NAME", required=True)
    grounding = experiments.add_parser(
        "grounding",
        help="hypothesis H1: the qualitative and the metric grounding of prepositions, combined",
        epilog=_EPILOG,
    )
    grounding.add_argument(
        "--tosd",
        type=Path,
        metavar="DIR",
        help="copy of the Table Object Scene Database, labelled with `scenesense label DIR` "
        "(default: simulated scenes)",
    )
    _add_common(grounding)
    for name, words, count in (
        (
            "axioms",
            "hypothesis H4: axioms learned from labelled scenes, Algorithm 1 and ours",
            2600,
        ),
        ("forgetting", "hypothesis H5: wrong axioms are found and forgotten, in ten cycles", 2400),
    ):
        learning = experiments.add_parser(name, help=words, epilog=_EPILOG)
        learning.add_argument(
            "--dataset",
            type=Path,
            metavar="DIR",
            help=f"labelled scenes made with `scenesense dataset generate DIR --count {count}` "
            "(default: simulate as many)",
        )
        _add_common(learning)


def run(arguments: argparse.Namespace) -> int:
    """Runs the experiment, prints, writes."""
    from ros_scenesense.cli.bench import show
    from ros_scenesense.experiments import axioms, forgetting, grounding
    from ros_scenesense.plots import write_plot
    from ros_scenesense.results import write_result

    path: Path | None = arguments.out
    if path is not None and path.suffix != ".json":
        raise ParameterError(f"--out is '{path}', must be a file name that ends in .json")
    command = shlex.join(["scenesense", *sys.argv[1:]])
    seed = int(_SEED.check(arguments.seed))
    jobs = int(_JOBS.check(arguments.jobs)) or len(os.sched_getaffinity(0))
    console = Console()
    if not console.is_terminal:
        console = Console(width=160)
    if arguments.experiment == "grounding":
        outcome = grounding.conduct(
            grounding.Options(command, seed, arguments.quick, jobs, arguments.tosd), console.print
        )
    else:
        conduct = axioms.conduct if arguments.experiment == "axioms" else forgetting.conduct
        outcome = conduct(
            axioms.Options(command, seed, arguments.quick, jobs, arguments.dataset), console.print
        )
    for note in outcome.result.notes:
        console.print(f"\n{note}", markup=False, highlight=False)
    show(outcome.result, console)
    if path is not None:
        write_result(outcome.result, path)
        write_plot(path.with_suffix(".png"), outcome.panels)
        console.print(f"written: {path}, with .md and .png beside it", soft_wrap=True)
    return 0


def _add_common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="few samples: see that it runs")
    parser.add_argument("--seed", default=_SEED.default, help=f"{_SEED.description} (default 0)")
    parser.add_argument("--jobs", default=_JOBS.default, help=f"{_JOBS.description} (default 0)")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the result there as JSON, with Markdown and plot beside it",
    )
