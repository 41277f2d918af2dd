"""What a trial found, and how it joins the results of the trials before it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import Result, Table, read_result

NAME = "reliability"
_SEPARATOR = " && "


@dataclass(frozen=True)
class Outcome:
    """Figures by name, and tables by title."""

    figures: dict[str, float]
    tables: dict[str, Table] = field(default_factory=dict)


def result_of(outcomes: Iterable[Outcome], command: str, seed: int, before: Path | None) -> Result:
    """One result of all trials.

    Args:
        outcomes: Of the trials that were made now.
        command: That made them.
        seed: Of everything random.
        before: A result whose figures stay where there are no new ones; None, or a file that is
            not there: there are no others.
    """
    figures: dict[str, float] = {}
    tables: dict[str, Table] = {}
    commands = [command]
    if before is not None and before.exists():
        old = read_result(before)
        figures, tables = dict(old.figures), dict(old.tables)
        commands = [*(each for each in old.command.split(_SEPARATOR) if each != command), command]
    for outcome in outcomes:
        figures |= outcome.figures
        tables |= outcome.tables
    return Result(
        name=NAME,
        command=_SEPARATOR.join(commands),
        seed=seed,
        versions=versions(),
        machine=machine(),
        figures=figures,
        tables=tables,
    )
