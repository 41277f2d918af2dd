"""Writes a stage's problems to the log: each one clearly, a flood of one kind in summaries."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from ros_scenesense.stages.health import Health

QUIET_S = 5.0
BURST = 3


@dataclass
class _Kind:
    """One kind of problem since `since`: the lines written, how many they told of, the newest."""

    since: float
    counted_before: int
    lines: int = 0
    held_back: str | None = None


class ProblemLog:
    """Turns the problems of a `Health` into warnings.

    The first few of a kind are logged at once. What follows within `QUIET_S` is held back and
    told in one line, with its number and the newest example, when that time is over.

    Args:
        health: Where the problems are taken from.
        warn: Writes one warning.
        clock: Seconds that only grow.
    """

    def __init__(
        self,
        health: Health,
        warn: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._health = health
        self._warn = warn
        self._clock = clock
        self._kinds: dict[str, _Kind] = {}
        self._counted: dict[str, int] = {}
        self._newest = -float("inf")

    def age_s(self) -> float:
        """Seconds since the newest problem; infinite if there was none."""
        return self._clock() - self._newest

    def report(self) -> None:
        """Logs what is new; called after every call of the stage and regularly."""
        now = self._clock()
        self._summarise(now)
        for name, words in self._health.take_problems():
            self._newest = now
            before = self._counted.get(name, 0)
            kind = self._kinds.setdefault(name, _Kind(since=now, counted_before=before))
            if kind.lines < BURST:
                kind.lines += 1
                self._warn(words)
            else:
                kind.held_back = words
        self._counted = dict(self._health.counters)

    def _summarise(self, now: float) -> None:
        for name, kind in list(self._kinds.items()):
            if now - kind.since < QUIET_S:
                continue
            del self._kinds[name]
            if kind.held_back is not None:
                # The health keeps only so many problems between two reports, but counts them all.
                more = self._counted[name] - kind.counted_before - kind.lines
                self._warn(
                    f"{kind.held_back} ({more} more of '{name}' in {now - kind.since:.0f} s)"
                )
