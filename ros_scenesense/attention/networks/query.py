"""The query network: one question, "is this object stable?" or "is it occluded?", one answer.

Where reasoning leaves a literal undecided, the question is about one object. So the network is
shown the region with that object marked, and those that it stands in a relevant relation to,
instead of being asked for all objects at once in an order that it has to find out first.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from ros_scenesense.attention.inputs import NUMBERS

CHANNELS = 6
"""Red, green, blue, depth relative to the target, mask of the target, mask of related objects."""

_PIXELS = 0.5
"""Share of the training samples whose pixels count."""


@dataclass(frozen=True)
class QueryNetworkConfiguration:
    """What a query network looks like.

    Attributes:
        side: Width and height of its input in pixels.
        channels: Channels of its input.
        filters: Of the first of three convolutions; each further one has half as many more.
        numbers: Numbers beside the image, see `attention.inputs`.
        dropout: Share of the features that are dropped in training.
        learning_rate: Adam's.
    """

    side: int = 32
    channels: int = CHANNELS
    filters: int = 8
    numbers: int = NUMBERS
    dropout: float = 0.5
    learning_rate: float = 3e-3


class QueryNetwork(nn.Module):
    """The network of a configuration; its outputs are the logits of stable and of occluded."""

    def __init__(self, configuration: QueryNetworkConfiguration) -> None:
        super().__init__()
        self.configuration = configuration
        channels = configuration.channels
        layers: list[nn.Module] = []
        for level in range(3):
            count = round(configuration.filters * 1.5**level)
            layers += [
                nn.Conv2d(channels, count, kernel_size=3, padding=1, bias=False),
                nn.BatchNorm2d(count),
                nn.ReLU(),
                nn.MaxPool2d(2),
            ]
            channels = count
        self.features = nn.Sequential(*layers, nn.AdaptiveAvgPool2d(2), nn.Flatten())
        last = nn.Linear(64, 2)
        # Pixels have no say before they have learned something.
        nn.init.zeros_(last.weight)
        nn.init.zeros_(last.bias)
        self.classifier = nn.Sequential(
            nn.Dropout(configuration.dropout), nn.Linear(4 * channels, 64), nn.ReLU(), last
        )
        # Few numbers drown among many features: they have a say of their own, and for half of the
        # training samples the only one.
        self.numbers = nn.Sequential(
            nn.BatchNorm1d(configuration.numbers),
            nn.Linear(configuration.numbers, 32),
            nn.ReLU(),
            nn.Linear(32, 2),
        )

    def forward(self, images: Tensor, numbers: Tensor) -> Tensor:
        """Logits (B, 2) of images (B, C, side, side) and numbers (B, N)."""
        features = self.features(images)  # (B, 4 * channels)
        seen = self.classifier(features)
        share: Tensor | float = _PIXELS  # of what they say; on the average as much as in training
        if self.training:
            share = (torch.rand_like(seen[:, :1]) < _PIXELS).float()
        logits: Tensor = share * seen + self.numbers(numbers)
        return logits
