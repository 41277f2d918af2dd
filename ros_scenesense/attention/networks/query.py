"""The query network: one question, "is this object stable?" or "is it occluded?", one answer.

Where reasoning leaves a literal undecided, the question is about one object. So the network is
shown the region with that object marked, and those that it stands in a relevant relation to,
instead of being asked for all objects at once in an order that it has to find out first.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

CHANNELS = 6
"""Red, green, blue, depth relative to the target, mask of the target, mask of related objects."""


@dataclass(frozen=True)
class QueryNetworkConfiguration:
    """What a query network looks like.

    Attributes:
        side: Width and height of its input in pixels.
        channels: Channels of its input.
        filters: Of the first convolution; each further one has half as many more.
        numbers: Numbers beside the image, see `attention.inputs`.
        dropout: Share of the features that are dropped in training.
        learning_rate: Adam's.
    """

    side: int = 64
    channels: int = CHANNELS
    filters: int = 16
    numbers: int = 4
    dropout: float = 0.3
    learning_rate: float = 2e-3


class QueryNetwork(nn.Module):
    """The network of a configuration; its outputs are the logits of stable and of occluded."""

    def __init__(self, configuration: QueryNetworkConfiguration) -> None:
        super().__init__()
        self.configuration = configuration
        channels, layers = configuration.channels, []
        for level in range(4):
            count = round(configuration.filters * 1.5**level)
            layers += [
                nn.Conv2d(channels, count, kernel_size=3, padding=1, bias=False),
                nn.BatchNorm2d(count),
                nn.ReLU(),
                nn.MaxPool2d(2),
            ]
            channels = count
        self.features = nn.Sequential(*layers, nn.AdaptiveAvgPool2d(2), nn.Flatten())
        self.classifier = nn.Sequential(
            nn.Dropout(configuration.dropout),
            nn.Linear(4 * channels, 64),
            nn.ReLU(),
            nn.Linear(64, 2),
        )
        # Few numbers drown among many features: they have a say of their own, and for half of the
        # training samples the only one.
        self.numbers = nn.Sequential(
            nn.Linear(configuration.numbers, 32), nn.ReLU(), nn.Linear(32, 2)
        )

    def forward(self, images: Tensor, numbers: Tensor) -> Tensor:
        """Logits (B, 2) of images (B, C, side, side) and numbers (B, N)."""
        features = self.features(images)  # (B, 4 * channels)
        seen = self.classifier(features)
        if self.training:
            seen = seen * (torch.rand_like(seen[:, :1]) < 0.5)
        logits: Tensor = seen + self.numbers(numbers)
        return logits
