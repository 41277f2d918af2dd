"""Cautious consequences of a grounded program: what holds in all of its answer sets."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import clingo

QUIET = ("--warn=no-atom-undefined",)
"""Arguments of a solver that says nothing of predicates of which there happen to be no atoms."""

CAUTIOUS = (*QUIET, "--enum-mode=cautious", "--opt-mode=optN")
"""Arguments of a solver whose models converge to what holds in all (optimal) answer sets."""

# Most scenes need no search at all; for them a thread that could be cancelled costs more than the
# search. So the first conflicts are for free, and only a search that needs more is watched.
_UNWATCHED_CONFLICTS = 500


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
    configuration: Any = control.configuration.solve
    configuration.solve_limit = str(_UNWATCHED_CONFLICTS)
    last = _Last()
    if control.solve(on_model=last.take).exhausted:
        return last.consequences()
    configuration.solve_limit = "umax"
    last = _Last()
    deadline = time.monotonic() + time_limit_s
    with control.solve(on_model=last.take, async_=True) as handle:
        if not handle.wait(max(0.0, deadline - time.monotonic())):
            handle.cancel()
            return Consequences(Outcome.TIMED_OUT)
        handle.get()
    return last.consequences()


class _Last:
    """Keeps the last model: each holds fewer atoms than the one before, the last is the answer."""

    def __init__(self) -> None:
        self._symbols: Sequence[clingo.Symbol] | None = None

    def take(self, model: clingo.Model) -> None:
        self._symbols = model.symbols(shown=True)

    def consequences(self) -> Consequences:
        if self._symbols is None:
            return Consequences(Outcome.NO_ANSWER_SET)
        return Consequences(Outcome.FOUND, self._symbols)
