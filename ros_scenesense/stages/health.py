"""Counters and the last problem of a stage: what becomes its diagnostics."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass
class Health:
    """What went wrong so far.

    Attributes:
        counters: How often each thing happened since the start.
        pending: Problems not yet reported, as (kind, words).
        last_problem: The newest problem in words; None if there was none.
    """

    counters: Counter[str] = field(default_factory=Counter)
    pending: list[tuple[str, str]] = field(default_factory=list)
    last_problem: str | None = None

    def count(self, kind: str, amount: int = 1) -> None:
        """Counts something that is worth a figure but no warning."""
        self.counters[kind] += amount

    def problem(self, kind: str, words: str) -> None:
        """Counts a problem and keeps it for one clear warning."""
        self.counters[kind] += 1
        self.last_problem = words
        # A flood of bad messages must not grow memory between two reports.
        if len(self.pending) < 100:
            self.pending.append((kind, words))

    def take_problems(self) -> Iterator[tuple[str, str]]:
        """The problems since the last call."""
        taken, self.pending = self.pending, []
        return iter(taken)
