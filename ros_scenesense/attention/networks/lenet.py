"""LeNet as the paper adapts it: two convolutions, two fully connected layers, sigmoid outputs.

Paper, section *Attention Mechanism and Deep Learning*; LeCun et al., 1998. Outputs are logits;
their sigmoids are the probabilities that a structure is stable, or an object occluded.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn


@dataclass(frozen=True)
class LeNetConfiguration:
    """What a LeNet looks like.

    Attributes:
        side: Width and height of its input in pixels.
        channels: Channels of its input.
        structures: Outputs for the stability of structures.
        objects: Outputs for the occlusion of objects.
        numbers: Numbers beside the image, given to the fully connected layers.
        learning_rate: Adam's (paper: 0.0002).
    """

    side: int = 56
    channels: int = 3
    structures: int = 1
    objects: int = 5
    numbers: int = 0
    learning_rate: float = 2e-4


class LeNet(nn.Module):
    """The network of a configuration."""

    def __init__(self, configuration: LeNetConfiguration) -> None:
        super().__init__()
        self.configuration = configuration
        self.features = nn.Sequential(
            nn.Conv2d(configuration.channels, 20, kernel_size=5),
            nn.MaxPool2d(2),
            nn.ReLU(),
            nn.Conv2d(20, 50, kernel_size=5),
            nn.MaxPool2d(2),
            nn.ReLU(),
            nn.Flatten(),
        )
        side = ((configuration.side - 4) // 2 - 4) // 2
        self.classifier = nn.Sequential(
            nn.Linear(50 * side * side + configuration.numbers, 500),
            nn.ReLU(),
            nn.Linear(500, configuration.structures + configuration.objects),
        )

    def forward(self, images: Tensor, numbers: Tensor) -> Tensor:
        """Logits (B, structures + objects) of images (B, C, side, side) and numbers (B, N)."""
        features = self.features(images)  # (B, 50 * side / 4 * side / 4)
        logits: Tensor = self.classifier(torch.cat([features, numbers], dim=1))
        return logits
