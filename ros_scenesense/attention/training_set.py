"""Examples as arrays, on their way from the memory of a stage to a training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import NetworkError

if TYPE_CHECKING:
    from ros_scenesense.attention.networks.samples import Samples


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """All that a network is to learn, and which of it is held out.

    Attributes:
        images: (N, C, side, side) float32.
        numbers: (N, M) float32.
        answers: (N, 2) float32, of stable and of occluded; NaN where not asked.
        groups: (N,) int64, the scene of each.
        held_out: (N,) bool; all examples of a scene alike.
    """

    images: npt.NDArray[np.float32]
    numbers: npt.NDArray[np.float32]
    answers: npt.NDArray[np.float32]
    groups: npt.NDArray[np.int64]
    held_out: npt.NDArray[np.bool_]

    def parts(self) -> tuple[Samples, Samples]:
        """What to train on, and what is held out.

        Raises:
            NetworkError: If one of them is empty.
        """
        from ros_scenesense.attention.networks.samples import Samples

        if self.held_out.all() or not self.held_out.any():
            raise NetworkError(
                f"{len(self.images)} examples of {len(np.unique(self.groups))} scenes are too few "
                "to train on some and hold out others: collect more"
            )
        whole = Samples(self.images, self.numbers, self.answers, self.groups)
        return whole[np.flatnonzero(~self.held_out)], whole[np.flatnonzero(self.held_out)]


def joined(sets: Sequence[TrainingSet]) -> TrainingSet:
    """All examples of several sets; a scene that is held out in one must be so in all."""
    names = ("images", "numbers", "answers", "groups", "held_out")
    parts = ([getattr(each, name) for each in sets] for name in names)
    return TrainingSet(*map(np.concatenate, parts))
