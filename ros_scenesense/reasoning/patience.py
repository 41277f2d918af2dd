"""A limit on the time that the solver searches; grounding cannot be interrupted."""

from __future__ import annotations

import math
import threading
import time
from types import TracebackType

import clingo


class Patience:
    """As a context: interrupts a solver when its time is up.

    Args:
        control: The solver.
        seconds: As long it may search, with everything in between.
    """

    def __init__(self, control: clingo.Control, seconds: float) -> None:
        self._seconds = seconds
        self._until = math.inf
        self._timer = threading.Timer(seconds, control.interrupt)
        self._timer.daemon = True

    @property
    def is_over(self) -> bool:
        """Whether the time is up; also where it was up before there was anything to interrupt."""
        return time.monotonic() >= self._until

    def __enter__(self) -> Patience:
        self._until = time.monotonic() + self._seconds
        self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._timer.cancel()
