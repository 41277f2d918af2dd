"""Runs an experiment of the paper, prints its tables, and writes them with a plot."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ros_scenesense.cli.console import console_of
from ros_scenesense.errors import ParameterError
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.parameters import Parameter

if TYPE_CHECKING:
    from ros_scenesense.experiments.options import Options

_EPILOG = """\
Figures of a full run are in docs/results/, with the command that made them.
"""
_SEED = Parameter("seed", int, 0, "seed of all that is drawn", minimum=0, maximum=2**53 - 1)
_SCENES = Parameter(
    "scenes", int, 0, "scenes to use, the first ones; 0 = all", minimum=0, maximum=1_000_000
)
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
    for name, words in (
        ("estimation", "hypothesis H2: reasoning and attention make networks more accurate"),
        ("samples", "hypothesis H3: reasoning and attention save training images"),
        ("backgrounds", "whether the number of backgrounds matters, with and without attention"),
    ):
        _add_estimation(experiments.add_parser(name, help=words, epilog=_EPILOG))
    for name, words, count in (
        ("axioms", "hypothesis H4: axioms from labelled scenes, Algorithm 1 and ours", 2600),
        ("forgetting", "hypothesis H5: wrong axioms are found and forgotten, in ten cycles", 2400),
        ("planning", "hypothesis H4: plans and decisions with and without learned axioms", 1200),
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
    from ros_scenesense.plots import write_plot
    from ros_scenesense.results import write_result

    path: Path | None = arguments.out
    if path is not None and path.suffix != ".json":
        raise ParameterError(f"--out is '{path}', must be a file name that ends in .json")
    console = console_of(160)
    conduct = {
        "grounding": _grounding,
        "axioms": _axioms,
        "forgetting": _forgetting,
        "planning": _planning,
    }.get(arguments.experiment, _estimation)
    outcome = conduct(arguments, lambda line: console.print(line, highlight=False))
    for note in outcome.result.notes:
        console.print(f"\n{note}", markup=False, highlight=False)
    show(outcome.result, console)
    if path is not None:
        write_result(outcome.result, path)
        write_plot(path.with_suffix(".png"), outcome.panels)
        console.print(f"written: {path}, with .md and .png beside it", soft_wrap=True)
    return 0


def _grounding(arguments: argparse.Namespace, say: Callable[[str], None]) -> Outcome:
    from ros_scenesense.experiments import grounding

    return grounding.conduct(_options(arguments, arguments.tosd), say)


def _axioms(arguments: argparse.Namespace, say: Callable[[str], None]) -> Outcome:
    from ros_scenesense.experiments import axioms

    return axioms.conduct(_options(arguments, arguments.dataset), say)


def _forgetting(arguments: argparse.Namespace, say: Callable[[str], None]) -> Outcome:
    from ros_scenesense.experiments import forgetting

    return forgetting.conduct(_options(arguments, arguments.dataset), say)


def _planning(arguments: argparse.Namespace, say: Callable[[str], None]) -> Outcome:
    from ros_scenesense.experiments import planning

    return planning.conduct(_options(arguments, arguments.dataset), say)


def _options(arguments: argparse.Namespace, dataset: Path | None) -> Options:
    from ros_scenesense.experiments.options import Options

    return Options(
        command=_command(),
        seed=int(_SEED.check(arguments.seed)),
        quick=arguments.quick,
        jobs=_jobs(arguments),
        dataset=dataset,
    )


def _estimation(arguments: argparse.Namespace, say: Callable[[str], None]) -> Outcome:
    from ros_scenesense.experiments import estimation, estimation_backgrounds

    backgrounds = arguments.experiment == "backgrounds"
    conduct = estimation_backgrounds.conduct if backgrounds else estimation.conduct
    return conduct(
        estimation.EstimationOptions(
            **vars(_options(arguments, arguments.dataset)),
            experiment=arguments.experiment,
            scenes=int(_SCENES.check(arguments.scenes)),
            network=arguments.network,
            schedule=arguments.schedule,
            device=arguments.device,
            ways=tuple(part.strip() for part in arguments.ways.split(",") if part.strip()),
            sizes=_sizes(arguments.sizes),
            work=arguments.work,
        ),
        say,
    )


def _sizes(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(",") if part.strip())
    except ValueError as error:
        raise ParameterError(f"--sizes is '{text}', must be numbers such as 100,1000") from error


def _command() -> str:
    return shlex.join(["scenesense", *sys.argv[1:]])


def _jobs(arguments: argparse.Namespace) -> int:
    return int(_JOBS.check(arguments.jobs)) or len(os.sched_getaffinity(0))


def _add_estimation(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--dataset",
        type=Path,
        metavar="DIR",
        help="a dataset of `scenesense dataset generate` (default: one is simulated)",
    )
    parser.add_argument(
        "--scenes", default=_SCENES.default, help=f"{_SCENES.description} (default 0)"
    )
    parser.add_argument(
        "--work",
        type=Path,
        metavar="DIR",
        help="keep what is done there, so that the same command goes on where it was interrupted",
    )
    parser.add_argument(
        "--sizes", default="", metavar="N,N", help="only these numbers of training images"
    )
    parser.add_argument(
        "--ways", default="", metavar="WAY,WAY", help="only these ways, e.g. lenet,lenet_att,query"
    )
    parser.add_argument(
        "--network",
        choices=("all", "lenet", "alexnet", "query"),
        default="all",
        help="only this one (default: %(default)s)",
    )
    parser.add_argument(
        "--schedule",
        choices=("validated", "paper"),
        default="validated",
        help="how long LeNet and AlexNet are trained: until scenes held out gain nothing, or the "
        "paper's numbers of iterations (default: %(default)s)",
    )
    parser.add_argument("--device", default="cpu", help="cpu, cuda, cuda:1, ... (default: cpu)")
    _add_common(parser)


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
