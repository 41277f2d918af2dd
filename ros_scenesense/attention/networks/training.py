"""Training: masked cross-entropy, early stopping on held-out scenes, calibrated probabilities.

Paper, section *Attention Mechanism and Deep Learning*: Adam, and a number of iterations that is
fixed beforehand. Its schedule trains far longer than helps; `patience` > 0 stops where the held-out
scenes get no better and keeps the best weights.
"""

from __future__ import annotations

import ast
import copy
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from ros_scenesense.attention.networks import checkpoints
from ros_scenesense.attention.networks.answers import TrainedNetwork, logits_of, masked_loss
from ros_scenesense.attention.networks.kinds import NetworkConfiguration, build
from ros_scenesense.attention.networks.samples import Samples
from ros_scenesense.errors import NetworkError


@dataclass(frozen=True)
class TrainingConfiguration:
    """How a network is trained.

    Attributes:
        iterations: Batches at most.
        batch: Samples in a batch.
        validation_share: Share of the scenes that are held out; 0 trains on all of them, and then
            nothing is stopped early or calibrated.
        interval: Iterations between two looks at the held-out scenes, and between checkpoints.
        patience: Looks without an improvement after which training ends; 0 = never.
        weight_decay: Adam's, apart from the gradient (Loshchilov and Hutter, 2019).
        flip: Whether half of the images are mirrored left to right, which changes no answer about
            a single object.
        seed: Of weights, batches and split.
    """

    iterations: int = 1500
    batch: int = 32
    validation_share: float = 0.2
    interval: int = 25
    patience: int = 12
    weight_decay: float = 0.0
    flip: bool = False
    seed: int = 0


def query_training(
    iterations: int, seed: int, patience: int = TrainingConfiguration.patience
) -> TrainingConfiguration:
    """How a query network is trained.

    Large batches, and weights that decay: with small ones, a hundred images taught it quite
    different things from seed to seed.

    Args:
        iterations: Batches at most.
        seed: Of weights, batches and split.
        patience: Looks without an improvement after which training ends.
    """
    return TrainingConfiguration(
        iterations=iterations, batch=64, patience=patience, weight_decay=0.01, flip=True, seed=seed
    )


PAPER_ITERATIONS = {
    "lenet": ((100, 10_000), (5000, 40_000)),
    "alexnet": ((100, 8_000), (5000, 20_000)),
}
"""The paper's iterations: (images, iterations), for its smallest and its largest training set."""


def paper_iterations(kind: str, images: int) -> int:
    """The paper's number of iterations; between its two figures along the logarithm of images."""
    (few, short), (many, long) = PAPER_ITERATIONS[kind]
    share = (math.log(images) - math.log(few)) / (math.log(many) - math.log(few))
    return round(short + min(1.0, max(0.0, share)) * (long - short))


@dataclass(frozen=True)
class Progress:
    """Where training is: `validation_loss` is None where nothing is held out."""

    iteration: int
    iterations: int
    training_loss: float
    validation_loss: float | None


def train(
    network_configuration: NetworkConfiguration,
    samples: Samples,
    configuration: TrainingConfiguration,
    report: Callable[[Progress], None] = lambda _progress: None,
    checkpoint: Path | None = None,
    device: str = "cpu",
) -> TrainedNetwork:
    """Trains a network from new weights, or goes on where a checkpoint stands.

    Same samples, configurations and device give the same network, also when interrupted.

    Args:
        network_configuration: Which network.
        samples: What to learn; a share of their scenes is held out.
        configuration: How to train.
        report: Called at every look at the held-out scenes.
        checkpoint: File that keeps the state of the training at every look. One of the same
            configurations and as many samples is continued; it is removed at the end.
        device: `cpu`, `cuda`, `cuda:1`, ...

    Raises:
        NetworkError: If the samples cannot teach anything, the device has too little memory, or the
            checkpoint is damaged or of another training.
    """
    held_out = None
    if configuration.validation_share > 0.0 and len(samples):
        generator = np.random.default_rng(configuration.seed)
        samples, held_out = samples.split(configuration.validation_share, generator)
    training = Training(network_configuration, samples, held_out, configuration, device)
    if checkpoint is not None and checkpoint.exists():
        training.resume(checkpoint)
    while not training.finished:
        report(training.advance())
        if checkpoint is not None and not training.finished:
            training.save(checkpoint)
    if checkpoint is not None:
        checkpoint.unlink(missing_ok=True)
    return training.result()


class Training:
    """A training that is under way, to be advanced piece by piece.

    Args:
        network_configuration: Which network; it starts from new weights.
        samples: What to learn.
        held_out: What decides when to stop, and calibrates; None trains to the last iteration.
        configuration: How to train; its `validation_share` has been used already.
        device: `cpu`, `cuda`, `cuda:1`, ...

    Raises:
        NetworkError: If the samples cannot teach anything, or there is no such device.
    """

    def __init__(
        self,
        network_configuration: NetworkConfiguration,
        samples: Samples,
        held_out: Samples | None,
        configuration: TrainingConfiguration,
        device: str = "cpu",
    ) -> None:
        _check(samples)
        self._configuration = configuration
        self._identity = {
            "network": asdict(network_configuration),
            "training": asdict(configuration),
            "samples": len(samples),
            "held_out": 0 if held_out is None else len(held_out),
        }
        self._generator = np.random.default_rng(configuration.seed)
        self._training, self._held_out = samples, held_out
        # Dropout draws from torch's own randomness: a state of its own keeps runs independent.
        self._device = torch.device(device)
        try:
            # Channels last is a third faster on a CPU.
            self.network = _laid_out(
                build(network_configuration, configuration.seed).to(self._device),
                torch.channels_last,
            )
        except (RuntimeError, AssertionError) as error:
            first = str(error).splitlines()[0]
            raise NetworkError(f"device '{device}' cannot be used: {first}; take cpu") from error
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(configuration.seed)
            self._random_state = torch.random.get_rng_state()
        self._optimizer = torch.optim.AdamW(
            self.network.parameters(),
            lr=network_configuration.learning_rate,
            weight_decay=configuration.weight_decay,
            fused=True,
        )
        self.iteration = 0
        self._loss = 0.0
        self._best: dict[str, Any] = {"loss": math.inf, "iteration": 0, "weights": None}

    @property
    def finished(self) -> bool:
        """Whether the last iteration is done, or the held-out scenes gain nothing any more."""
        configuration = self._configuration
        looks = (self.iteration - self._best["iteration"]) // configuration.interval
        waited = self._held_out is not None and 0 < configuration.patience <= looks
        return waited or self.iteration >= configuration.iterations

    def advance(self) -> Progress:
        """Trains until the next look at what is held out, and looks.

        Raises:
            NetworkError: If the device has too little memory.
        """
        try:
            while True:
                self._step()
                if self.iteration % self._configuration.interval == 0 or self.finished:
                    return self._look()
        except torch.OutOfMemoryError as error:
            raise NetworkError(
                f"the device '{self._device}' has too little memory for batches of "
                f"{self._configuration.batch}: take smaller batches, or the CPU"
            ) from error

    def save(self, path: Path) -> None:
        """Keeps all that it takes to go on."""
        content = {
            "identity": self._identity,
            "iteration": self.iteration,
            "loss": self._loss,
            "best": self._best,
            "optimizer": self._optimizer.state_dict(),
            # As text: the integers of the generator are longer than those of a tensor.
            "generator": repr(self._generator.bit_generator.state),
            "random_state": self._random_state,
        }
        checkpoints.save(path, self.network, content)

    def resume(self, path: Path) -> None:
        """Goes on where `save` was called.

        Raises:
            NetworkError: If the file is damaged or of another training.
        """
        network, content = checkpoints.load(path)
        if content.get("identity") != self._identity:
            raise NetworkError(
                f"checkpoint '{path}' is of another training: remove it, or give the configuration "
                "and the samples that it was made with"
            )
        self.network.load_state_dict(network.state_dict())
        self._optimizer.load_state_dict(content["optimizer"])
        self._generator.bit_generator.state = ast.literal_eval(content["generator"])
        self._random_state = content["random_state"]
        self.iteration, self._loss = content["iteration"], content["loss"]
        self._best = content["best"]

    def result(self) -> TrainedNetwork:
        """The best network on the CPU, calibrated."""
        iterations = self.iteration
        if self._best["weights"] is not None:
            self.network.load_state_dict(self._best["weights"])
            iterations = self._best["iteration"]
        # As it will be when it is read again, to the last bit.
        network = _laid_out(self.network.cpu().eval(), torch.contiguous_format)
        if self._held_out is None:
            return TrainedNetwork(network, iterations=iterations)
        logits = logits_of(network, self._held_out.images, self._held_out.numbers)
        temperature = _temperature(logits, torch.from_numpy(self._held_out.answers))
        return TrainedNetwork(network, temperature, self._best["loss"], iterations)

    def _step(self) -> None:
        """Trains on one batch."""
        count = min(self._configuration.batch, len(self._training))
        batch = self._training[self._generator.choice(len(self._training), count, replace=False)]
        images = batch.images
        if self._configuration.flip:
            mirrored = self._generator.random(count) < 0.5
            images = np.where(mirrored[:, None, None, None], images[..., ::-1], images)
        self.network.train()
        with torch.random.fork_rng(devices=[]):
            torch.random.set_rng_state(self._random_state)
            logits = self.network(self._tensor(images), self._tensor(batch.numbers))
            self._random_state = torch.random.get_rng_state()
        loss = masked_loss(logits, self._tensor(batch.answers))
        self._optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self._optimizer.step()
        self._loss = float(loss.detach())
        self.iteration += 1

    def _look(self) -> Progress:
        """Measures on the held-out scenes and keeps the best weights."""
        loss = None
        if self._held_out is not None:
            loss = self._validation_loss(self._held_out)
            if loss < self._best["loss"]:
                weights = copy.deepcopy(self.network.state_dict())
                self._best = {"loss": loss, "iteration": self.iteration, "weights": weights}
        return Progress(self.iteration, self._configuration.iterations, self._loss, loss)

    def _validation_loss(self, samples: Samples) -> float:
        logits = logits_of(self.network, samples.images, samples.numbers)
        return float(masked_loss(logits, torch.from_numpy(samples.answers)))

    def _tensor(self, array: npt.NDArray[np.float32]) -> Tensor:
        tensor = torch.from_numpy(np.ascontiguousarray(array)).to(self._device)
        return tensor.to(memory_format=torch.channels_last) if tensor.ndim == 4 else tensor


def _laid_out(network: nn.Module, order: torch.memory_format) -> nn.Module:
    """The network with its weights in another order in memory; the types of torch forget this."""
    same: nn.Module = network.to(memory_format=order)  # type: ignore[call-overload]
    return same


def _check(samples: Samples) -> None:
    if len(samples) == 0:
        raise NetworkError("there is nothing to train on: collect labelled examples first")
    if len(samples) == 1:
        raise NetworkError("one example alone teaches nothing: collect labelled examples first")
    known = samples.answers[~np.isnan(samples.answers)]
    if not known.size:
        raise NetworkError("no sample has an answer: training needs labels")
    if known.min() == known.max():
        said = "true" if known[0] else "false"
        raise NetworkError(
            f"all {known.size} answers are {said}: a network learns nothing from one class alone, "
            "collect examples of the other"
        )


def _temperature(logits: Tensor, answers: Tensor) -> float:
    """The temperature with the least loss; one number can hardly be fitted too closely."""
    candidates = np.geomspace(0.25, 8.0, 61)
    losses = [float(masked_loss(logits / float(each), answers)) for each in candidates]
    return float(candidates[int(np.argmin(losses))])
