"""Planning in scenes drawn at random: all shortest plans, and an optimal plan of nine actions."""

from __future__ import annotations

import numpy as np

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.errors import ReasoningError
from ros_scenesense.reasoning.described_scenes import KnownScene, described_scene
from ros_scenesense.reasoning.planning import Aim, Planning, PlanningLimits, PlanOutcome, plan
from ros_scenesense.reasoning.situations import Situation, robot_domain
from ros_scenesense.results import Table
from ros_scenesense.scene import Size, Surface

_OBJECTS = (4, 6, 8, 10)
_TARGETS = {4: 15.0, 10: 42.0}
_TALLEST = 5
_OPTIMAL = f"plan_optimal_ms_{2 * _TALLEST - 1}"

FIGURES = (
    *(
        Figure(
            f"plan_all_minimal_ms_{count}",
            f"all shortest plans to have one of {count} objects on another, mean, ms CPU",
            at_most=_TARGETS.get(count),
        )
        for count in _OBJECTS
    ),
    Figure(
        _OPTIMAL,
        f"a plan of {2 * _TALLEST - 1} actions among 10 objects, proven optimal, mean, ms CPU",
        at_most=300.0,
    ),
)


def measure(options: BenchOptions) -> Measured:
    """Times both on random scenes."""
    tasks = 3 if options.quick else 40
    figures: dict[str, float] = {}
    rows: list[list[str | int | float | None]] = []
    for count in _OBJECTS:
        found = _all_minimal(count, tasks, options.seed)
        name = f"plan_all_minimal_ms_{count}"
        figures[name] = 1e3 * float(np.mean([each.seconds for each in found]))
        rows.append(_row(name, found))
    found = _optimal(tasks, options.seed)
    figures[_OPTIMAL] = 1e3 * float(np.mean([each.seconds for each in found]))
    rows.append(_row(_OPTIMAL, found))
    columns = ["figure", "tasks", "actions", "plans", "mean ms", "95 % ms", "longest ms"]
    return Measured(figures, {"Planning": Table(columns=columns, rows=rows)})


def _row(name: str, found: list[Planning]) -> list[str | int | float | None]:
    milliseconds = np.array([1e3 * each.seconds for each in found])
    lengths = [len(each.plans[0].actions) for each in found]
    plans = [len(each.plans) for each in found]
    times = [float(milliseconds.mean()), float(np.percentile(milliseconds, 95.0))]
    means = [float(np.mean(lengths)), float(np.mean(plans))]
    return [name, len(found), *means, *times, float(milliseconds.max())]


def _all_minimal(count: int, tasks: int, seed: int) -> list[Planning]:
    """The plans of so many tasks that have some."""
    rng = np.random.default_rng([seed, count])
    found: list[Planning] = []
    while len(found) < tasks:
        situation = Situation(robot_domain(), _scene(rng, count))
        upper, lower = rng.permutation(count)[:2]
        task = situation.task(situation.goal(f"on(o{upper}, o{lower})"))
        planning = plan(task, PlanningLimits(every=True))
        if planning.outcome is PlanOutcome.FOUND:
            found.append(planning)
    return found


def _optimal(tasks: int, seed: int) -> list[Planning]:
    """Plans to hold the lowest object of a tower, proven to have fewest exceptions and actions.

    Raises:
        ReasoningError: If one is not what it must be.
    """
    rng = np.random.default_rng([seed, _TALLEST])
    found: list[Planning] = []
    for _ in range(tasks):
        situation = Situation(robot_domain(), _scene(rng, 10, tower=_TALLEST))
        task = situation.task(situation.goal("in_hand(rob1, o0)"))
        planning = plan(task, PlanningLimits(Aim.OPTIMAL))
        if not planning.complete or len(planning.plans[0].actions) != 2 * _TALLEST - 1:
            raise ReasoningError(f"the planner failed: {planning}")
        found.append(planning)
    return found


def _scene(rng: np.random.Generator, count: int, tower: int = 1) -> KnownScene:
    """Random stacks of objects of all sizes; one in five has an irregular surface.

    Args:
        rng: Source of the scene.
        count: Objects `o0`, `o1`, ...
        tower: The first so many objects, with flat surfaces, stand on each other.
    """
    objects, relations = {}, []
    tops: list[tuple[int, int]] = []  # the highest object of each stack, and its level
    for number in range(count):
        flat = number < tower or rng.random() < 0.8
        surface = Surface.FLAT if flat else Surface.IRREGULAR
        objects[f"o{number}"] = {"size": str(rng.choice(list(Size))), "surface": surface.value}
        carriers = [
            index
            for index, (top, level) in enumerate(tops)
            if level < 4 and objects[f"o{top}"]["surface"] == Surface.FLAT.value
        ]
        if 0 < number < tower:
            chosen = 0
        elif number >= tower and carriers and rng.random() < 0.6:
            chosen = int(rng.choice(carriers))
        else:
            tops.append((number, 1))
            continue
        top, level = tops[chosen]
        relations.append(f"on(o{number}, o{top})")
        tops[chosen] = (number, level + 1)
    return described_scene({"objects": objects, "relations": relations}, "random scene")
