"""Reasoning alone, without images: CPU time of this process, one thread, scenes drawn at random."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.reasoning.classification import ClassificationSession
from ros_scenesense.reasoning.explanation.scenes import SceneExplainer
from ros_scenesense.reasoning.program import Program
from ros_scenesense.reasoning.random_facts import random_facts
from ros_scenesense.results import Table

_CLASSIFY_TARGETS = {5: 1.5, 10: 1.6, 20: 3.0, 40: 6.0}
_REPEATS = 5
Case = TypeVar("Case")

FIGURES = (
    *(
        Figure(
            f"classify_ms_{count}",
            f"classification of a scene with {count} objects, median CPU time, ms",
            at_most=target,
        )
        for count, target in _CLASSIFY_TARGETS.items()
    ),
    Figure(
        "classify_growth",
        "time of 40 objects over that of 20; 4 if time grows with the square",
        at_most=4.0,
    ),
    Figure("explain_ms_5", "why, for each object of a scene with 5: median CPU time, ms"),
    Figure("explain_ms_40", "the same of a scene with 40 objects, ms"),
)


def measure(options: BenchOptions) -> Measured:
    """Times classification and explanation on scenes with all their relations."""
    scenes = 5 if options.quick else 40
    rows: list[list[str | int | float | None]] = []
    figures: dict[str, float] = {}
    for name, milliseconds in {
        **_classification(scenes, options.seed),
        **_explanation(scenes, options.seed),
    }.items():
        p50, p95 = np.percentile(milliseconds, [50.0, 95.0])
        figures[name] = float(p50)
        rows.append([name, len(milliseconds), float(p50), float(p95), max(milliseconds)])
    figures["classify_growth"] = figures["classify_ms_40"] / figures["classify_ms_20"]
    columns = ["figure", "measurements", "median ms", "95 % ms", "longest ms"]
    return Measured(figures, {"Reasoning, CPU time": Table(columns=columns, rows=rows)})


def _classification(scenes: int, seed: int) -> dict[str, list[float]]:
    session = ClassificationSession(Program.shipped())
    found = {}
    for count in _CLASSIFY_TARGETS:
        facts = [random_facts(count, np.random.default_rng((seed, i))) for i in range(scenes)]
        session.classify(facts[0])
        found[f"classify_ms_{count}"] = _cpu_ms(session.classify, facts * _REPEATS)
    return found


def _explanation(scenes: int, seed: int) -> dict[str, list[float]]:
    program = Program.shipped()

    def explain(case: tuple[SceneExplainer, str]) -> None:
        explainer, literal = case
        explainer.explain(explainer.literal(literal))

    found = {}
    for count in (5, 40):
        cases = []
        for index in range(min(scenes, 5)):
            facts = random_facts(count, np.random.default_rng((seed, index)))
            explainer = SceneExplainer(program, facts)
            cases += [(explainer, f"-stable({each.name})") for each in facts.objects[:5]]
        found[f"explain_ms_{count}"] = _cpu_ms(explain, cases)
    return found


def _cpu_ms(step: Callable[[Case], object], cases: Iterable[Case]) -> list[float]:
    """Milliseconds of CPU time for each case."""
    times = []
    for case in cases:
        start = time.process_time()
        step(case)
        times.append((time.process_time() - start) * 1e3)
    return times
