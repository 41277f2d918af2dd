"""Estimates from people's words by how much their axes are turned against the viewer's.

People name left and right along axes of their own: those of the robot when they began to teach it.
When the camera moves to another side of the table, the viewer's axes turn away from these, and the
fixed meaning of the prepositions is no longer theirs. Every word about a pair of known direction
says something about the angle. The estimate is Bayesian: words that contradict the present angle
speak for a change at some time, but people also err. How often they do is learned from the words
themselves: after many that fit, a few contradictions are a proof, among many errors they are not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float
from ros_scenesense.scene import Position


@dataclass(frozen=True)
class ViewpointSettings:
    """What is assumed of people and of viewpoints.

    Attributes:
        error_share: Share of the words that are wrong, before any is heard.
        error_weight: That share is believed as if it came from so many words.
        blur_rad: How sharp the borders between two directions are.
        change_share: How likely it is that the viewpoint changes between one word and the next. The
            less likely, the more words it takes to prove it, and the less harm wrong words do.
        moved_share: The same if the camera is known to have moved.
        memory: So many words are remembered.
    """

    error_share: float = 0.1
    error_weight: float = 10.0
    blur_rad: float = math.radians(8.0)
    change_share: float = 0.0003
    moved_share: float = 0.8
    memory: int = 60


class ViewpointEstimator:
    """The angle, about up, by which the axes of people are turned to the left of the viewer's.

    Attributes:
        yaw_rad: The estimate; exactly 0 until there is evidence for another angle.
    """

    def __init__(self, settings: ViewpointSettings | None = None) -> None:
        self.settings = settings or ViewpointSettings()
        self.yaw_rad = 0.0
        self._turned = False
        self._expected = False
        # By word: azimuth in the viewer's axes, the direction that was named, and how likely a
        # change of the viewpoint was just before it.
        self._words = np.empty((0, 3))

    @property
    def expects_change(self) -> bool:
        """Whether no word that says something came since the camera moved."""
        return self._expected

    def expect_change(self) -> None:
        """The camera is known to have moved: from now on another angle is likely."""
        self._expected = True

    def observe(self, position: Position, azimuth_rad: float) -> bool:
        """Takes a word of a person.

        Args:
            position: What they called it; only directions in the plane of the table say something.
            azimuth_rad: Where the object is, seen from the reference, in the viewer's axes.

        Returns:
            Whether another angle became more likely than the one before this word.
        """
        if position not in _DIRECTIONS_RAD:
            return False
        settings = self.settings
        share = settings.moved_share if self._expected else settings.change_share
        self._expected = False
        word = [[azimuth_rad, _DIRECTIONS_RAD[position], share]]
        self._words = np.concatenate([self._words, word])[-settings.memory :]
        errors = self._error_shares()
        since = self._change(errors)
        if since is not None:
            self._words, self._turned = self._words[since:], True
        if self._turned:
            fits = self._fits(_GRID_RAD)
            share = float(errors[since or 0])
            self.yaw_rad = _mean_angle(_log_likelihoods(fits, share).sum(axis=0))
        return since is not None

    def to_arrays(self) -> dict[str, np.ndarray]:
        """What is remembered, as plain arrays: for a file."""
        return {
            "yaw": np.array([self.yaw_rad, float(self._turned), float(self._expected)]),
            "words": self._words.copy(),
        }

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, np.ndarray], settings: ViewpointSettings | None = None
    ) -> ViewpointEstimator:
        """The estimator that `to_arrays` described.

        Raises:
            ValueError: If an array is missing, of another shape, or not finite.
        """
        yaw, words = arrays.get("yaw"), arrays.get("words")
        if yaw is None or yaw.shape != (3,) or not np.isfinite(yaw).all():
            raise ValueError("array 'yaw' must hold three numbers, the first of them an angle")
        if words is None or words.ndim != 2 or words.shape[1] != 3 or not np.isfinite(words).all():
            raise ValueError("array 'words' must hold an azimuth, a direction and a share each")
        if (words[:, 2] <= 0.0).any() or (words[:, 2] >= 1.0).any():
            raise ValueError("array 'words' must hold shares between 0 and 1")
        estimator = cls(settings)
        estimator.yaw_rad = float(yaw[0])
        estimator._turned, estimator._expected = bool(yaw[1]), bool(yaw[2])
        estimator._words = np.array(words, dtype=np.float64)
        return estimator

    def _fits(self, yaws: Float) -> Float:
        """How well every word fits every angle, from 0 to 1: (words, angles)."""
        off = self._words[:, :1] - self._words[:, 1:2] - yaws
        off = np.abs(np.remainder(off + math.pi, 2.0 * math.pi) - math.pi)
        return np.asarray(1.0 / (1.0 + np.exp((off - math.pi / 4.0) / self.settings.blur_rad)))

    def _error_shares(self) -> Float:
        """The share of wrong words, as it was known before every word; (words,)."""
        weight = self.settings.error_weight
        wrong, shares = weight * self.settings.error_share, []
        for number, fit in enumerate(self._fits(np.array([self.yaw_rad]))[:, 0]):
            share = wrong / (weight + number)
            shares.append(share)
            error = share / len(_DIRECTIONS_RAD)
            wrong += error / (error + (1.0 - share) * float(fit))
        return np.array(shares)

    def _change(self, errors: Float) -> int | None:
        """The first word of a new viewpoint; None if a change is not more likely than none.

        Args:
            errors: As `_error_shares` gives them.
        """
        fits = self._fits(_GRID_RAD)
        present = _log_likelihoods(self._fits(np.array([self.yaw_rad]))[:, 0], errors)
        before = np.concatenate([[0.0], np.cumsum(present)[:-1]])
        # Entry k: the words from k on are about another angle, any angle being as likely.
        changed = before + np.log(self._words[:, 2] / (1.0 - self._words[:, 2]))
        for first, share in enumerate(errors):
            since = _log_likelihoods(fits[first:], float(share)).sum(axis=0)
            changed[first] += since.max() + math.log(float(np.exp(since - since.max()).mean()))
        top = float(changed.max())
        total = top + math.log(float(np.exp(changed - top).sum()))
        return int(changed.argmax()) if total > float(present.sum()) else None


_DIRECTIONS_RAD = {
    Position.RIGHT: 0.0,
    Position.BEHIND: math.pi / 2.0,
    Position.LEFT: math.pi,
    Position.FRONT: -math.pi / 2.0,
}
_GRID_RAD = np.radians(np.arange(-180.0, 180.0, 3.0))


def _log_likelihoods(fits: Float, error_share: float | Float) -> Float:
    """Of words that fit so well, if that share of words is wrong."""
    error = error_share / len(_DIRECTIONS_RAD)
    return np.asarray(np.log(error + (1.0 - error_share) * fits))


def _mean_angle(log_likelihood: Float) -> float:
    """Circular mean of the angles of the grid."""
    weights = np.exp(log_likelihood - log_likelihood.max())
    return float(np.angle((weights * np.exp(1j * _GRID_RAD)).sum()))
