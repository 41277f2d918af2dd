"""Runs all groups of benchmarks and makes one result of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ros_scenesense.bench import (
    attention,
    classification,
    datasets,
    decisions,
    graph,
    learning,
    loop,
    perception,
    reasoning,
    sparc,
    steps,
)
from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import Result, Table


@dataclass(frozen=True)
class Group:
    """A module of benchmarks.

    Attributes:
        title: What is measured, for people who wait.
        figures: The figures that it gives.
        measure: Measures them.
    """

    title: str
    figures: tuple[Figure, ...]
    measure: Callable[[BenchOptions], Measured]


GROUPS = (
    Group("the graph, real nodes", graph.FIGURES, graph.measure),
    Group("the whole loop: speed, transport, restarts", loop.FIGURES, loop.measure),
    Group("grounding and classification, single scenes", steps.FIGURES, steps.measure),
    Group("objects told apart and described", perception.FIGURES, perception.measure),
    Group("reasoning about scenes", classification.FIGURES, classification.measure),
    Group("knowledge and reasoning", reasoning.FIGURES, reasoning.measure),
    Group("attention and networks", attention.FIGURES, attention.measure),
    Group("learning axioms", learning.FIGURES, learning.measure),
    Group("SPARC programs", sparc.FIGURES, sparc.measure),
    Group("decisions against physics, many scenes", decisions.FIGURES, decisions.measure),
    Group("datasets of simulated scenes", datasets.FIGURES, datasets.measure),
)


def run_suite(
    options: BenchOptions,
    command: str,
    report: Callable[[str], None],
    groups: Iterable[Group] = GROUPS,
) -> Result:
    """Measures all groups, one after the other.

    Args:
        options: How to measure.
        command: The command line, for the result.
        report: Takes a line before each group.
        groups: What to measure.
    """
    figures: dict[str, float] = {}
    tables: dict[str, Table] = {}
    rows: list[list[str | int | float | None]] = []
    for group in groups:
        report(f"measuring {group.title} ...")
        measured = group.measure(options)
        figures |= measured.figures
        tables |= measured.tables
        rows += [
            row(figure, figures[figure.name]) for figure in group.figures if figure.name in figures
        ]
    columns = ["figure", "measured", "target", "times better", "meaning"]
    return Result(
        name="bench",
        command=command,
        seed=options.seed,
        versions=versions(),
        machine=machine(),
        figures={name: round(value, 4) for name, value in figures.items()},
        tables={"Figures": Table(columns=columns, rows=rows), **tables},
    )


def row(figure: Figure, value: float) -> list[str | int | float | None]:
    """A figure beside its target, as a row of the table of figures."""
    ratio = figure.ratio(value)
    rounded = None if ratio is None else round(ratio, 2)
    return [figure.name, round(value, 4), figure.target, rounded, figure.meaning]
