"""Samples: what a network is trained and asked on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import NetworkError


@dataclass(frozen=True, eq=False)
class Samples:
    """Inputs and the answers that belong to them.

    Attributes:
        images: (N, C, side, side) float32.
        numbers: (N, M) float32, numbers beside the images; M may be 0.
        answers: (N, O) float32: 1 true, 0 false, NaN where an output has no answer. It is left out
            of the loss: an absent object, an ambiguous label, the other task.
        groups: (N,) int64, the scene of each sample: no scene is both trained on and validated on.

    Raises:
        NetworkError: If the arrays do not belong together, or an answer is none.
    """

    images: npt.NDArray[np.float32]
    numbers: npt.NDArray[np.float32]
    answers: npt.NDArray[np.float32]
    groups: npt.NDArray[np.int64]

    def __post_init__(self) -> None:
        lengths = {len(self.images), len(self.numbers), len(self.answers), len(self.groups)}
        if len(lengths) != 1:
            raise NetworkError(
                f"{len(self.images)} images, {len(self.numbers)} rows of numbers, "
                f"{len(self.answers)} rows of answers and {len(self.groups)} scenes do not belong "
                "together: give one of each per sample"
            )
        if not (np.isfinite(self.images).all() and np.isfinite(self.numbers).all()):
            raise NetworkError(
                "a sample holds a value that is no number: fill the holes of its depth image"
            )
        if not np.isin(self.answers[~np.isnan(self.answers)], (0.0, 1.0)).all():
            raise NetworkError("an answer is neither 0 (false), 1 (true) nor NaN (not known)")

    def __len__(self) -> int:
        return len(self.images)

    def __getitem__(self, indices: npt.NDArray[np.generic]) -> Samples:
        return Samples(
            self.images[indices], self.numbers[indices], self.answers[indices], self.groups[indices]
        )

    def split(self, share: float, generator: np.random.Generator) -> tuple[Samples, Samples]:
        """Samples to train on, and this share of the scenes to validate on (at least one scene).

        Raises:
            NetworkError: If there are fewer than two scenes.
        """
        scenes = np.unique(self.groups)
        if len(scenes) < 2:
            raise NetworkError(
                f"{len(scenes)} scenes cannot be split into training and validation: collect "
                "examples of at least two"
            )
        count = min(len(scenes) - 1, max(1, round(share * len(scenes))))
        held_out = np.isin(self.groups, generator.permutation(scenes)[:count])
        return self[np.flatnonzero(~held_out)], self[np.flatnonzero(held_out)]
