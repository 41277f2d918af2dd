"""A trained network and its answers: calibrated probabilities, on disk and back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from ros_scenesense.attention.networks import checkpoints
from ros_scenesense.attention.networks.samples import Samples
from ros_scenesense.errors import NetworkError


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
        logits = logits_of(self.network, images, numbers)
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

    def accuracy(self, samples: Samples) -> float:
        """Share of the known answers that it gives right."""
        said = self.probabilities(samples.images, samples.numbers) >= 0.5
        known = ~np.isnan(samples.answers)
        return float((said == (samples.answers > 0.5))[known].mean())

    def loss(self, samples: Samples) -> float:
        """Mean cross-entropy of its answers, as calibrated; what two networks are compared by."""
        logits = logits_of(self.network, samples.images, samples.numbers)
        return float(masked_loss(logits / self.temperature, torch.from_numpy(samples.answers)))


def masked_loss(logits: Tensor, answers: Tensor) -> Tensor:
    """Mean cross-entropy over the outputs (B, O) that have an answer; 0 where none has one."""
    known = ~torch.isnan(answers)
    if not known.any():
        return logits.sum() * 0.0
    return nn.functional.binary_cross_entropy_with_logits(logits[known], answers[known])


def logits_of(
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
