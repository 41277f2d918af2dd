"""The attention stage's slow work: asking networks, and training them piece by piece.

Training goes on in pieces of a second or less, so that a scene that comes in between is answered.
Each call names the file of the network to ask: a process that was started anew needs no more.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.training_set import TrainingSet
from ros_scenesense.errors import NetworkError
from ros_scenesense.stages.freed_memory import give_memory_back
from ros_scenesense.stages.packed_examples import PackedExamples

if TYPE_CHECKING:
    from ros_scenesense.attention.networks.answers import TrainedNetwork
    from ros_scenesense.attention.networks.training import Training


@dataclass(frozen=True)
class TrainingOrder:
    """A training to be done.

    Attributes:
        side: Pixels of the network's input.
        iterations: Batches at most.
        seed: Of weights and batches.
        device: `cpu`, `cuda`, ...
        file: Where the network is written.
        checkpoint: Where the training is kept while it is under way.
        rival: File of the network in use; None if there is none.
    """

    side: int
    iterations: int
    seed: int
    device: str
    file: str
    checkpoint: str
    rival: str | None


class TrainingState(NamedTuple):
    """Where a training is.

    Attributes:
        share: How much of it is done at least, from 0 to 1.
        finished: Whether the network is trained.
        loss: Of the network on the held-out examples; None before the end.
        rival_loss: Of the network in use on the same examples; None where there is none.
    """

    share: float
    finished: bool = False
    loss: float | None = None
    rival_loss: float | None = None

    @property
    def better(self) -> bool:
        """Whether the new network is to be used."""
        if self.loss is None:
            return False
        return self.rival_loss is None or self.loss < self.rival_loss


class AttentionEngine:
    """Asks and trains networks.

    Args:
        file: Of the network that will be asked first; None if there is none yet.
    """

    def __init__(self, file: str | None = None) -> None:
        # torch takes seconds to import, which the first scene should not pay.
        import ros_scenesense.attention.networks.training  # noqa: F401

        self._networks: dict[str, TrainedNetwork] = {}
        self._training: tuple[TrainingOrder, TrainingSet, Training] | None = None
        if file is not None:
            self._warm_up(file)

    def answer(
        self, file: str, images: npt.NDArray[np.float32], numbers: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.float32]:
        """Probabilities (N, 2) of stable and of occluded, for queries as `attention.inputs` has.

        Raises:
            NetworkError: If the network cannot be read.
        """
        return self._network(file).probabilities(images, numbers)

    def begin(self, order: TrainingOrder, packed: PackedExamples) -> TrainingState:
        """Begins a training, or goes on with one that was interrupted.

        Raises:
            NetworkError: If the examples cannot teach anything.
        """
        from ros_scenesense.attention.networks.query import QueryNetworkConfiguration
        from ros_scenesense.attention.networks.training import Training, query_training

        examples = packed.unpacked()
        training, held_out = examples.parts()
        begun = Training(
            QueryNetworkConfiguration(side=order.side),
            training,
            held_out,
            query_training(order.iterations, order.seed),
            order.device,
        )
        checkpoint = Path(order.checkpoint)
        if checkpoint.exists():
            try:
                begun.resume(checkpoint)
            except NetworkError:
                checkpoint.unlink()  # of other examples, or damaged: from the beginning
        self._training = (order, examples, begun)
        return TrainingState(begun.iteration / order.iterations)

    def advance(self) -> TrainingState:
        """Trains a little further; at the end writes the network.

        Raises:
            NetworkError: If nothing was begun, or the network cannot be written.
        """
        if self._training is None:
            raise NetworkError("the training was lost with its process: begin it again")
        order, examples, training = self._training
        progress = training.advance()
        if not training.finished:
            training.save(Path(order.checkpoint))
            return TrainingState(progress.iteration / order.iterations)
        trained = training.result()
        trained.save(Path(order.file))
        Path(order.checkpoint).unlink(missing_ok=True)
        self._training = None
        _, held_out = examples.parts()
        rival_loss = None if order.rival is None else self._network(order.rival).loss(held_out)
        state = TrainingState(1.0, True, trained.loss(held_out), rival_loss)
        del training, examples, held_out, trained
        give_memory_back()
        return state

    def _warm_up(self, file: str) -> None:
        """Asks about nothing: the first answer takes many times as long as any other."""
        try:
            configuration: Any = self._network(file).network.configuration
            shape = (1, configuration.channels, configuration.side, configuration.side)
            numbers = np.zeros((1, configuration.numbers), np.float32)
            self.answer(file, np.zeros(shape, np.float32), numbers)
        except NetworkError:
            return  # who asks is told

    def _network(self, file: str) -> TrainedNetwork:
        from ros_scenesense.attention.networks.answers import TrainedNetwork

        if file not in self._networks:
            self._networks = {file: TrainedNetwork.load(Path(file))}
        return self._networks[file]
