"""What a benchmark measures: figures with targets, and what a run of a group gives."""

from __future__ import annotations

from dataclasses import dataclass, field

from ros_scenesense.results import Table


@dataclass(frozen=True)
class Figure:
    """A figure with a stable name.

    Attributes:
        name: Name in the results.
        meaning: What it is, with the unit, for people.
        at_least: Target that it must reach; None if it has none.
        at_most: Target that it must not pass; None if it has none.
    """

    name: str
    meaning: str
    at_least: float | None = None
    at_most: float | None = None

    @property
    def target(self) -> str:
        """The target in words; empty if there is none."""
        if self.at_least is not None and self.at_most is not None:
            return f"{self.at_least:g} to {self.at_most:g}"
        if self.at_least is not None:
            return f"at least {self.at_least:g}"
        return f"at most {self.at_most:g}" if self.at_most is not None else ""

    def ratio(self, value: float) -> float | None:
        """How many times better than the target a value is: 1 and more reaches it."""
        ratios = []
        if self.at_least is not None:
            ratios.append(value / self.at_least)
        if self.at_most is not None:
            ratios.append(self.at_most / value if value > 0.0 else float("inf"))
        return min(ratios, default=None)


@dataclass(frozen=True)
class BenchOptions:
    """How to measure.

    Attributes:
        seed: Seed of the simulated scenes.
        quick: Whether to take few samples, to see that the benchmarks run.
    """

    seed: int = 0
    quick: bool = False


@dataclass(frozen=True)
class Measured:
    """Figures by name, and tables by title."""

    figures: dict[str, float]
    tables: dict[str, Table] = field(default_factory=dict)
