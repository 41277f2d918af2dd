"""What an experiment gives: its result, and the plot that goes with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ros_scenesense.plots import Panel
from ros_scenesense.results import Result


@dataclass(frozen=True)
class Outcome:
    """Of an experiment.

    Attributes:
        result: Figures, tables and notes.
        panels: The plot.
    """

    result: Result
    panels: Sequence[Panel] = ()
