"""Training: masked cross-entropy, early stopping on held-out scenes, calibrated probabilities.

Paper, section *Attention Mechanism and Deep Learning*: Adam, and a number of iterations that is
fixed beforehand. Its schedule trains far longer than helps; `patience` > 0 stops where the held-out
scenes get no better and keeps the best weights.
"""

from __future__ import annotations

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
        weight_decay: Adam's.
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


@dataclass(frozen=True, eq=False)
class TrainedNetwork:
    """A network that answers with probabilities.

    Attributes:
        network: The network, with the best weights.
        temperature: Its logits are divided by it, so that probabilities are shares of right
            answers (Guo et al., 2017); measured on the held-out scenes.
        validation_loss: On the held-out scenes; None without any.
        iterations: Batches that the weights were trained on.
    """

    network: nn.Module
    temperature: float = 1.0
    validation_loss: float | None = None
    iterations: int = 0

    def probabilities(
        self, images: npt.NDArray[np.float32], numbers: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.float32]:
        """Probabilities (N, O) of the outputs being true, for images (N, C, side, side)."""
        logits = _logits(self.network, images, numbers)
        return np.asarray(torch.sigmoid(logits / self.temperature).numpy(), dtype=np.float32)

    def save(self, path: Path) -> None:
        """Writes it, atomically.

        Raises:
            NetworkError: If the file cannot be written.
        """
        content = {
            "temperature": self.temperature,
            "validation_loss": self.validation_loss,
            "iterations": self.iterations,
        }
        checkpoints.save(path, self.network, content)

    @classmethod
    def load(cls, path: Path) -> TrainedNetwork:
        """Reads what `save` wrote.

        Raises:
            NetworkError: If the file is missing, damaged or of another version.
        """
        network, content = checkpoints.load(path)
        try:
            return cls(network, **content)
        except TypeError as error:
            raise NetworkError(f"'{path}' is a checkpoint of a training, no network") from error


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
        samples: What to learn.
        configuration: How to train.
        report: Called at every look at the held-out scenes.
        checkpoint: File that keeps the state of the training at every look. One of the same
            configurations and as many samples is continued; it is removed at the end.
        device: `cpu`, `cuda`, `cuda:1`, ...

    Raises:
        NetworkError: If the samples cannot teach anything, the device has too little memory, or the
            checkpoint is damaged or of another training.
    """
    _check(samples)
    try:
        run = _Run(network_configuration, samples, configuration, device)
        if checkpoint is not None and checkpoint.exists():
            run.resume(checkpoint)
        while not run.finished:
            run.step()
            if run.iteration % configuration.interval == 0 or run.finished:
                report(run.look())
                if checkpoint is not None and not run.finished:
                    run.save(checkpoint)
        trained = run.result()
    except torch.OutOfMemoryError as error:
        raise NetworkError(
            f"the device '{device}' has too little memory for batches of {configuration.batch}: "
            "take smaller batches, or the CPU"
        ) from error
    if checkpoint is not None:
        checkpoint.unlink(missing_ok=True)
    return trained


def masked_loss(logits: Tensor, answers: Tensor) -> Tensor:
    """Mean cross-entropy over the outputs (B, O) that have an answer; 0 where none has one."""
    known = ~torch.isnan(answers)
    if not known.any():
        return logits.sum() * 0.0
    return nn.functional.binary_cross_entropy_with_logits(logits[known], answers[known])


class _Run:
    """A training that is under way."""

    def __init__(
        self,
        network_configuration: NetworkConfiguration,
        samples: Samples,
        configuration: TrainingConfiguration,
        device: str,
    ) -> None:
        self._configuration = configuration
        self._identity = {
            "network": asdict(network_configuration),
            "training": asdict(configuration),
            "samples": len(samples),
        }
        self._generator = np.random.default_rng(configuration.seed)
        self._training, self._held_out = samples, None
        if configuration.validation_share > 0.0:
            self._training, self._held_out = samples.split(
                configuration.validation_share, self._generator
            )
        # Dropout draws from torch's own randomness: a state of its own keeps runs independent.
        self._random_state = torch.random.get_rng_state()
        self._device = torch.device(device)
        self.network = build(network_configuration, configuration.seed).to(self._device)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(configuration.seed)
            self._random_state = torch.random.get_rng_state()
        self._optimizer = torch.optim.Adam(
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

    def step(self) -> None:
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

    def look(self) -> Progress:
        """Measures on the held-out scenes and keeps the best weights."""
        loss = None
        if self._held_out is not None:
            loss = self._validation_loss(self._held_out)
            if loss < self._best["loss"]:
                weights = copy.deepcopy(self.network.state_dict())
                self._best = {"loss": loss, "iteration": self.iteration, "weights": weights}
        return Progress(self.iteration, self._configuration.iterations, self._loss, loss)

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
        import ast

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
        network = self.network.cpu().eval()
        if self._held_out is None:
            return TrainedNetwork(network, iterations=iterations)
        logits = _logits(network, self._held_out.images, self._held_out.numbers)
        temperature = _temperature(logits, torch.from_numpy(self._held_out.answers))
        return TrainedNetwork(network, temperature, self._best["loss"], iterations)

    def _validation_loss(self, samples: Samples) -> float:
        logits = _logits(self.network, samples.images, samples.numbers)
        return float(masked_loss(logits, torch.from_numpy(samples.answers)))

    def _tensor(self, array: npt.NDArray[np.float32]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(array)).to(self._device)


def _check(samples: Samples) -> None:
    if len(samples) == 0:
        raise NetworkError("there is nothing to train on: collect labelled examples first")
    known = samples.answers[~np.isnan(samples.answers)]
    if not known.size:
        raise NetworkError("no sample has an answer: training needs labels")
    if known.min() == known.max():
        said = "true" if known[0] else "false"
        raise NetworkError(
            f"all {known.size} answers are {said}: a network learns nothing from one class alone, "
            "collect examples of the other"
        )


def _logits(
    network: nn.Module, images: npt.NDArray[np.float32], numbers: npt.NDArray[np.float32]
) -> Tensor:
    """Logits (N, O) on the CPU, in batches that fit any device."""
    device = next(network.parameters()).device
    network.eval()
    parts = []
    with torch.inference_mode():
        for start in range(0, len(images), 256):
            part = slice(start, start + 256)
            pixels = torch.from_numpy(np.ascontiguousarray(images[part])).to(device)
            beside = torch.from_numpy(np.ascontiguousarray(numbers[part])).to(device)
            parts.append(network(pixels, beside).cpu())
    return torch.cat(parts)


def _temperature(logits: Tensor, answers: Tensor) -> float:
    """The temperature with the least loss; one number can hardly be fitted too closely."""
    candidates = np.geomspace(0.25, 8.0, 61)
    losses = [float(masked_loss(logits / float(each), answers)) for each in candidates]
    return float(candidates[int(np.argmin(losses))])
