"""Examples on their way to the worker that learns from them, as small as they are kept on disk.

Unpacked they need 100 kB each, several times: that is the worker's, which gives it back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.inputs import unpack
from ros_scenesense.attention.training_set import TrainingSet
from ros_scenesense.errors import NetworkError


@dataclass(frozen=True, eq=False)
class PackedExamples:
    """All that a network is to learn.

    Attributes:
        side: Pixels of the images.
        images: N packed images.
        numbers: N times the bytes of float32 numbers.
        answers: (N, 2) float32, of stable and of occluded; NaN where not asked.
        groups: (N,) int64, the scene of each.
        held_out: (N,) bool; all examples of a scene alike.
    """

    side: int
    images: tuple[bytes, ...]
    numbers: tuple[bytes, ...]
    answers: npt.NDArray[np.float32]
    groups: npt.NDArray[np.int64]
    held_out: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        """How many there are."""
        return len(self.images)

    def check(self) -> None:
        """Whether one can train on some and hold out others.

        Raises:
            NetworkError: If not.
        """
        if self.held_out.all() or not self.held_out.any():
            raise NetworkError(
                f"{len(self)} examples of {len(np.unique(self.groups))} scenes are too few "
                "to train on some and hold out others: collect more"
            )

    def unpacked(self) -> TrainingSet:
        """The same as arrays.

        Raises:
            NetworkError: If an image is damaged.
        """
        return TrainingSet(
            images=np.stack([unpack(image, self.side) for image in self.images]),
            numbers=np.stack([np.frombuffer(each, np.float32) for each in self.numbers]),
            answers=self.answers,
            groups=self.groups,
            held_out=self.held_out,
        )
