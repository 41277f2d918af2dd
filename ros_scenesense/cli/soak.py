"""Tries the running graph: hours of work, nodes killed at random, nonsense on every topic."""

from __future__ import annotations

import argparse
import contextlib
import shlex
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from ros_scenesense.cli.bench import show
from ros_scenesense.cli.console import console_of
from ros_scenesense.demo.domains import LAST_DOMAIN
from ros_scenesense.errors import ParameterError
from ros_scenesense.parameters import Parameter
from ros_scenesense.results import write_result

_EPILOG = """\
Real nodes look at labelled scenes and learn. What is asked for is done in turn: the soak (memory of
every node), the kills (what was acknowledged against what is on disk), the fuzz (counted, nobody
dead, the same decisions). With --json figures of other trials in the file stay as they are, so
that the trials can be made one by one.
"""
_PARAMETERS = (
    Parameter("minutes", float, 0.0, "length of the soak", minimum=0.0, maximum=100_000.0),
    Parameter("kills", int, 0, "nodes killed at random moments", minimum=0, maximum=100_000),
    Parameter("fuzz", int, 0, "invalid messages sent", minimum=0, maximum=10_000_000),
    Parameter("rate", float, 1.0, "scenes per second", minimum=0.01, maximum=100.0),
    Parameter("interval", float, 4.0, "mean seconds between two kills", minimum=0.1),
    Parameter("seed", int, 0, "seed of all that is random", minimum=0, maximum=2**53 - 1),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense soak`."""
    parser.epilog = _EPILOG
    for each in _PARAMETERS:
        words = f"{each.description} (default {each.default:g})"
        parser.add_argument(f"--{each.name}", default=each.default, help=words)
    parser.add_argument(
        "--domain-id", metavar="ID", type=int, help="ROS domain (default: one that nobody uses)"
    )
    parser.add_argument(
        "--folder", metavar="DIR", type=Path, help="keep state, logs and samples of memory there"
    )
    parser.add_argument(
        "--json",
        metavar="FILE",
        type=Path,
        help="write the result there, as Markdown beside it, and the plot of the soak",
    )


def run(arguments: argparse.Namespace) -> int:
    """Makes the trials, prints and writes what they found.

    Returns:
        0; figures that are not as they should be are shown, not an error.
    """
    values = {each.name: each.check(getattr(arguments, each.name)) for each in _PARAMETERS}
    if not any(values[name] for name in ("minutes", "kills", "fuzz")):
        raise ParameterError("nothing to do: say --minutes, --kills or --fuzz")
    if arguments.json is not None and arguments.json.suffix != ".json":
        raise ParameterError(
            f"parameter 'json' is '{arguments.json}', must be a file name that ends in .json"
        )
    if arguments.domain_id is not None and not 0 <= arguments.domain_id <= 232:
        raise ParameterError(
            f"domain id is {arguments.domain_id}, must be an integer from 0 to {LAST_DOMAIN}"
        )
    # Imports ROS: not for `--help`.
    from ros_scenesense.plots import write_plot
    from ros_scenesense.reliability.fuzz import fuzz
    from ros_scenesense.reliability.kills import kill_at_random
    from ros_scenesense.reliability.outcome import result_of
    from ros_scenesense.reliability.soak import outcome_of, panels_of, soak
    from ros_scenesense.reliability.trial import TrialOptions

    console = console_of(140)

    def report(line: str) -> None:
        console.print(f"{time.strftime('%X')} {line}", markup=False, highlight=False)

    outcomes, panels = [], []
    with _folder(arguments.folder) as folder:

        def options(name: str) -> TrialOptions:
            (folder / name).mkdir(parents=True, exist_ok=True)
            return TrialOptions(
                folder / name,
                seed=int(values["seed"]),
                rate_hz=float(values["rate"]),
                domain_id=arguments.domain_id,
                record=name == "soak",
            )

        if values["minutes"]:
            found = soak(options("soak"), float(values["minutes"]), report)
            outcomes.append(outcome_of(found))
            panels = panels_of(found.samples)
        if values["kills"]:
            kills, interval_s = int(values["kills"]), float(values["interval"])
            outcomes.append(kill_at_random(options("kills"), kills, interval_s, report))
        if values["fuzz"]:
            outcomes.append(fuzz(options("fuzz"), int(values["fuzz"]), report))
    command = _command(values, arguments.json)
    result = result_of(outcomes, command, int(values["seed"]), arguments.json)
    show(result, console)
    for name, value in result.figures.items():
        console.print(f"{name}: {value:g}", highlight=False)
    if arguments.json is not None:
        write_result(result, arguments.json)
        if panels:
            write_plot(arguments.json.with_suffix(".png"), panels)
    return 0


@contextlib.contextmanager
def _folder(wanted: Path | None) -> Iterator[Path]:
    if wanted is not None:
        yield wanted
        return
    with tempfile.TemporaryDirectory(prefix="scenesense-") as folder:
        yield Path(folder)


def _command(values: dict[str, bool | int | float | str], json: Path | None) -> str:
    words = ["scenesense", "soak"]
    for each in _PARAMETERS:
        if values[each.name] != each.default:
            words += [f"--{each.name}", f"{values[each.name]:g}"]
    return shlex.join(words if json is None else [*words, "--json", str(json)])
