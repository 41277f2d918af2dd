"""How axioms are forgotten (paper: strength e^(-alpha n), with a decay that reinforcement slows).

A step is one learning cycle, never wall time. In each step the strength of all axioms falls; one
that is learned again or used has its full strength back and decays more slowly from then on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

FORGOTTEN_BELOW = 0.1
"""Threshold th4 of the paper: axioms below this strength are removed."""


@dataclass(frozen=True)
class Strength:
    """Of one axiom.

    Attributes:
        decay: The factor alpha.
        idle: Steps n since the axiom was learned or reinforced.
    """

    decay: float = 1.0
    idle: int = 0

    @property
    def value(self) -> float:
        """The strength, from 0 to 1."""
        return math.exp(-self.decay * self.idle)

    def step(self) -> Strength:
        """The strength one step later."""
        return Strength(self.decay, self.idle + 1)

    def reinforced(self) -> Strength:
        """After reinforcement: at its maximum; alpha is divided by the n-th root of 2.

        Right after the last reinforcement, n = 0, there is no such root and nothing to slow down.
        """
        if self.idle == 0:
            return self
        return Strength(self.decay / 2.0 ** (1.0 / self.idle), 0)
