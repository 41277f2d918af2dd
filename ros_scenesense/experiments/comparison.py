"""What repeated measurements show: mean, spread, interval, and whether one way beats another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

SURE = 0.95
"""A difference is shown if chance alone would bring it in at most one of twenty experiments."""


@dataclass(frozen=True)
class Summary:
    """Measurements of one figure.

    Attributes:
        mean: Their mean.
        deviation: Standard deviation of the sample; 0 for a single one.
        margin: Half length of the 95 % interval of the mean, by Student's distribution.
    """

    mean: float
    deviation: float
    margin: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Summary:
        """Summarises measurements, at least one."""
        from scipy import stats

        count = len(values)
        if count < 2:
            return cls(float(values[0]), 0.0, 0.0)
        deviation = float(np.std(values, ddof=1))
        quantile = float(stats.t.ppf(0.5 + SURE / 2.0, count - 1))
        return cls(float(np.mean(values)), deviation, quantile * deviation / count**0.5)


@dataclass(frozen=True)
class Comparison:
    """Whether the first of two ways is better, measured on the same sets.

    Attributes:
        difference: Mean of first less second.
        probability: Of a difference at least as large if neither were better (paired t-test, both
            sides); 1 if they never differ.
    """

    difference: float
    probability: float

    @classmethod
    def of(cls, first: Sequence[float], second: Sequence[float]) -> Comparison:
        """Compares measurements, pair by pair."""
        from scipy import stats

        differences = np.subtract(first, second)
        if len(differences) < 2 or np.ptp(differences) == 0.0:
            # The test divides by the spread of the differences.
            constant = len(differences) > 1 and differences[0] != 0.0
            return cls(float(differences.mean()), 0.0 if constant else 1.0)
        return cls(float(differences.mean()), float(stats.ttest_rel(first, second).pvalue))

    @property
    def verdict(self) -> str:
        """`shown`, `the opposite is shown`, or `not shown`."""
        if self.probability > 1.0 - SURE:
            return "not shown"
        return "shown" if self.difference > 0.0 else "the opposite is shown"
