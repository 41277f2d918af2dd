"""Cautious consequences of a grounded program: what holds in all of its answer sets."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import clingo

CAUTIOUS = ("--enum-mode=cautious",)
"""Arguments of a solver whose models converge to what holds in all answer sets."""


class Outcome(Enum):
    """How solving ended."""

    FOUND = "found"
    NO_ANSWER_SET = "no answer set"
    TIMED_OUT = "timed out"


@dataclass(frozen=True)
class Consequences:
    """The shown atoms that hold in all answer sets; empty unless the outcome is FOUND."""

    outcome: Outcome
    symbols: Sequence[clingo.Symbol] = ()


def solve(control: clingo.Control, time_limit_s: float) -> Consequences:
    """Solves a grounded program that was given the arguments `CAUTIOUS`.

    Args:
        control: The solver, after grounding.
        time_limit_s: The search is cancelled after this time; grounding is not part of it.
    """
    symbols: Sequence[clingo.Symbol] | None = None
    deadline = time.monotonic() + time_limit_s
    with control.solve(yield_=True, async_=True) as handle:
        while True:
            handle.resume()
            if not handle.wait(max(0.0, deadline - time.monotonic())):
                handle.cancel()
                return Consequences(Outcome.TIMED_OUT)
            model = handle.model()
            if model is None:
                break
            # Each model holds fewer atoms than the one before; the last is the answer.
            symbols = model.symbols(shown=True)
    if symbols is None:
        return Consequences(Outcome.NO_ANSWER_SET)
    return Consequences(Outcome.FOUND, symbols)
