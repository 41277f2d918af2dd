"""How an experiment is run, and the dataset that it uses: one that is given, or a simulated one."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ros_scenesense.simulation.engine import SimulationConfiguration


@dataclass(frozen=True)
class Options:
    """How an experiment is run.

    Attributes:
        command: The command line, for the result.
        seed: Of everything that is drawn.
        quick: Few and small sets, to see that it runs.
        jobs: Worker processes.
        dataset: Folder of the scenes; None simulates them.
    """

    command: str
    seed: int = 0
    quick: bool = False
    jobs: int = 1
    dataset: Path | None = None


@contextmanager
def dataset_of(
    options: Options,
    count: int,
    say: Callable[[str], None],
    configuration: SimulationConfiguration | None = None,
) -> Iterator[Path]:
    """The dataset that was given, or a new one that is removed afterwards.

    Args:
        options: Of the experiment.
        count: So many scenes are simulated.
        say: Takes a line now and then.
        configuration: Of the simulation.
    """
    from ros_scenesense.simulation.dataset.generation import generate
    from ros_scenesense.simulation.dataset.metadata import DatasetOptions, describe
    from ros_scenesense.simulation.engine import SimulationConfiguration

    if options.dataset is not None:
        yield options.dataset
        return

    def report(done: int, whole: int) -> None:
        if done % 200 == 0:
            say(f"{done} of {whole} scenes simulated")

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "dataset"
        drawn = configuration or SimulationConfiguration()
        metadata = describe(drawn, DatasetOptions(count=count, seed=options.seed))
        generate(folder, metadata, options.jobs, report)
        yield folder
