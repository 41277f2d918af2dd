"""A limit on the time that the solver searches; grounding cannot be interrupted."""

from __future__ import annotations

import threading
from types import TracebackType

import clingo


class Patience:
    """As a context: interrupts a solver when its time is up.

    Args:
        control: The solver.
        seconds: As long it may search, with everything in between.

    Attributes:
        is_over: Whether the time is up.
    """

    def __init__(self, control: clingo.Control, seconds: float) -> None:
        self.is_over = False
        self._control = control
        self._timer = threading.Timer(seconds, self._end)
        self._timer.daemon = True

    def __enter__(self) -> Patience:
        self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._timer.cancel()

    def _end(self) -> None:
        self.is_over = True
        self._control.interrupt()
