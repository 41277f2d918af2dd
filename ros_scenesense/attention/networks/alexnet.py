"""AlexNet as the paper adapts it: five convolutions, each with max-pooling, three dense layers.

Paper, section *Attention Mechanism and Deep Learning*; Krizhevsky et al., 2012. Outputs are logits,
in the order of LeNet's. The original pools after three of its five convolutions; the paper's text
has a pooling layer after each, which is followed here.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn


@dataclass(frozen=True)
class AlexNetConfiguration:
    """What an AlexNet looks like.

    Attributes:
        side: Width and height of its input in pixels.
        channels: Channels of its input.
        structures: Outputs for the stability of structures.
        objects: Outputs for the occlusion of objects.
        numbers: Numbers beside the image, given to the fully connected layers.
        width: Share of the original's filters and neurons, for machines without a GPU.
        learning_rate: Adam's (paper: 0.0001).
    """

    side: int = 227
    channels: int = 3
    structures: int = 1
    objects: int = 5
    numbers: int = 0
    width: float = 1.0
    learning_rate: float = 1e-4


class AlexNet(nn.Module):
    """The network of a configuration."""

    def __init__(self, configuration: AlexNetConfiguration) -> None:
        super().__init__()
        self.configuration = configuration
        channels = configuration.channels
        filters = [max(1, round(configuration.width * count)) for count in (96, 256, 384, 384, 256)]
        neurons = max(1, round(configuration.width * 4096))
        layers: list[nn.Module] = []
        side = configuration.side
        for count, kernel, stride, padding in zip(
            filters, (11, 5, 3, 3, 3), (4, 1, 1, 1, 1), (0, 2, 1, 1, 1), strict=True
        ):
            layers += [
                nn.Conv2d(channels, count, kernel, stride, padding),
                nn.MaxPool2d(kernel_size=3, stride=2, padding=1),
                nn.ReLU(),
            ]
            side = (side + 2 * padding - kernel) // stride + 1  # 55, 28, 14, 7, 4 at 227 pixels
            side = (side - 1) // 2 + 1  # 28, 14, 7, 4, 2
            channels = count
        self.features = nn.Sequential(*layers, nn.Flatten())
        self.classifier = nn.Sequential(
            nn.Dropout(),
            nn.Linear(channels * side * side + configuration.numbers, neurons),
            nn.ReLU(),
            nn.Dropout(),
            nn.Linear(neurons, neurons),
            nn.ReLU(),
            nn.Linear(neurons, configuration.structures + configuration.objects),
        )

        for layer in self.modules():
            if isinstance(layer, nn.Conv2d | nn.Linear):
                # Through eight layers, torch's own start fades to nothing (He et al., 2015).
                nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
                if layer.bias is not None:
                    nn.init.zeros_(layer.bias)

    def forward(self, images: Tensor, numbers: Tensor) -> Tensor:
        """Logits (B, structures + objects) of images (B, C, side, side) and numbers (B, N)."""
        features = self.features(images)  # (B, filters * side / 128 * side / 128)
        logits: Tensor = self.classifier(torch.cat([features, numbers], dim=1))
        return logits
