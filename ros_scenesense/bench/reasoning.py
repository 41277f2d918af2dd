"""Knowledge and reasoning in this process, one question at a time; CPU time."""

from __future__ import annotations

from ros_scenesense.bench import planning
from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.bench.timing import median_ms
from ros_scenesense.knowledge.action_language import load
from ros_scenesense.knowledge.translation import translate
from ros_scenesense.resources import resource

FIGURES = (
    Figure(
        "al_translate_ms",
        "the robot's domain read, checked and translated, median, ms CPU",
        at_most=50.0,
    ),
    *planning.FIGURES,
)


def measure(options: BenchOptions) -> Measured:
    """Measures all figures of the group."""
    plans = planning.measure(options)
    figures = {"al_translate_ms": _translate_ms(options), **plans.figures}
    return Measured(figures, plans.tables)


def _translate_ms(options: BenchOptions) -> float:
    path = resource("asp", "robot_assistant.al")

    def read_and_translate() -> None:
        domain = load(path)
        translate(domain.description, domain.history)

    return median_ms(read_and_translate, 3 if options.quick else 30)
