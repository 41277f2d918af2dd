"""Trains the network of attention on labelled scenes, for `attention.network`."""

from __future__ import annotations

import argparse
import tempfile
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from ros_scenesense.cli.declared import add_declared, value_of
from ros_scenesense.errors import ParameterError
from ros_scenesense.parameters import Parameter, build

_EPILOG = """\
The scenes go through the whole loop: camera, grounding, control, reasoner, attention. Whatever
reasoning leaves undecided or gets wrong becomes an example. Use the network with
`scenesense launch -p attention.network=FILE`.
"""
_SCENES = Parameter(
    "scenes", int, 600, "simulated scenes to learn from", minimum=2, maximum=100_000
)
_SEED = Parameter("seed", int, 0, "seed of scenes and training", minimum=0, maximum=2**53 - 1)
_ITERATIONS = Parameter("iterations", int, 3000, "batches at most", minimum=1, maximum=1_000_000)
_ALL = "s1,s2,s3,o1,o2,o3"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense train`."""
    parser.epilog = _EPILOG
    parser.add_argument("--out", type=Path, metavar="FILE", required=True, help="the network")
    parser.add_argument(
        "--dataset", type=Path, metavar="DIR", help="learn from the scenes of a dataset instead"
    )
    add_declared(parser, (_SCENES, _SEED, _ITERATIONS))
    parser.add_argument(
        "--noise",
        default="kinect",
        help="of the depth camera: none or kinect (default: %(default)s)",
    )
    parser.add_argument(
        "--withheld",
        action="append",
        metavar="IDS",
        help="axioms that reasoning does without, so that there is something to learn; given "
        f"several times, the scenes are shown again for each (default: {_ALL}, and then none)",
    )
    parser.add_argument("--device", default="cpu", help="cpu, cuda, cuda:1, ... (default: cpu)")


def run(arguments: argparse.Namespace) -> int:
    """Collects, trains, writes the network."""
    from ros_scenesense.attention.networks.query import QueryNetworkConfiguration
    from ros_scenesense.attention.networks.training import Training, query_training
    from ros_scenesense.attention.training_set import joined
    from ros_scenesense.experiments.labelled_scenes import collect_examples
    from ros_scenesense.stages.attention import SIDE
    from ros_scenesense.stages.attention_store import AttentionStore
    from ros_scenesense.stages.health import Health
    from ros_scenesense.stages.reasoner import ReasonerConfiguration
    from ros_scenesense.stages.simulated_camera import SimulatedCameraConfiguration

    if arguments.out.suffix != ".pt":
        raise ParameterError(f"--out is '{arguments.out}', must be a file name that ends in .pt")
    seed, iterations = value_of(arguments, _SEED), value_of(arguments, _ITERATIONS)
    values: dict[str, object] = {"seed": seed, "noise": arguments.noise}
    scenes = None
    if arguments.dataset is None:
        scenes = values["scenes"] = value_of(arguments, _SCENES)
    else:
        values["dataset"] = str(arguments.dataset)
    camera = build(SimulatedCameraConfiguration, values)
    reasoners = [
        build(ReasonerConfiguration, {"withheld": each})
        for each in (arguments.withheld if arguments.withheld else (_ALL, ""))
    ]
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}")
    with tempfile.TemporaryDirectory() as state, Progress(*columns, TimeRemainingColumn()) as bars:
        collected = []
        for number, reasoner in enumerate(reasoners):
            bar = bars.add_task(f"scenes, without {reasoner.withheld or 'none'}", total=scenes)
            folder = Path(state) / str(number)
            judged = collect_examples(camera, reasoner, str(folder), partial(_show, bars, bar))
            store = AttentionStore(folder / "attention.db", Health(), SIDE)
            collected.append(store.training_set().unpacked())
            store.close()
        training, held_out = joined(collected).parts()
        bar = bars.add_task("iterations at most", total=iterations)
        going = Training(
            QueryNetworkConfiguration(side=SIDE),
            training,
            held_out,
            query_training(iterations, seed),
            arguments.device,
        )
        while not going.finished:
            bars.update(bar, completed=going.advance().iteration)
    trained = going.result()
    trained.save(arguments.out)
    Console().print(
        f"{arguments.out}: trained on {len(training)} examples of {judged} scenes, "
        f"{trained.iterations} iterations; loss {trained.loss(held_out):.3f} and "
        f"{trained.accuracy(held_out):.1%} right on {len(held_out)} held-out examples",
        soft_wrap=True,
        highlight=False,
    )
    return 0


def _show(bars: Progress, bar: TaskID, done: int) -> None:
    bars.update(bar, completed=done)
