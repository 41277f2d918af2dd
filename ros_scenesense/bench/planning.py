"""Planning in scenes drawn at random: all shortest plans, and an optimal plan of nine actions.

The shortest plans are also looked for by a program that was written for clingo by hand, for these
tasks alone; so it is seen what a domain in the action language costs.
"""

from __future__ import annotations

import time

import numpy as np

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.bench.planning_by_hand import plans_by_hand
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
        "plan_all_ratio",
        "all shortest plans: CPU relative to a minimal program for the same tasks written for "
        "clingo by hand, the worst of these numbers of objects",
        at_most=3.0,
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
    ratios = []
    for count in _OBJECTS:
        found, by_hand = _all_minimal(count, tasks, options.seed)
        name = f"plan_all_minimal_ms_{count}"
        figures[name] = 1e3 * float(np.mean([each.seconds for each in found]))
        ratios.append(sum(each.seconds for each in found) / sum(by_hand))
        rows.append([*_row(name, found), 1e3 * float(np.mean(by_hand))])
    figures["plan_all_ratio"] = max(ratios)
    found = _optimal(tasks, options.seed)
    figures[_OPTIMAL] = 1e3 * float(np.mean([each.seconds for each in found]))
    rows.append([*_row(_OPTIMAL, found), None])
    columns = ["figure", "tasks", "actions", "plans", "mean ms", "95 % ms", "longest ms"]
    table = Table(columns=[*columns, "by hand, mean ms"], rows=rows)
    return Measured(figures, {"Planning": table})


def _row(name: str, found: list[Planning]) -> list[str | int | float | None]:
    milliseconds = np.array([1e3 * each.seconds for each in found])
    lengths = [len(each.plans[0].actions) for each in found]
    plans = [len(each.plans) for each in found]
    times = [float(milliseconds.mean()), float(np.percentile(milliseconds, 95.0))]
    means = [float(np.mean(lengths)), float(np.mean(plans))]
    return [name, len(found), *means, *times, float(milliseconds.max())]


def _all_minimal(count: int, tasks: int, seed: int) -> tuple[list[Planning], list[float]]:
    """The plans of so many tasks that have some, and the CPU seconds of the program by hand.

    Raises:
        ReasoningError: If the two do not find the same plans.
    """
    rng = np.random.default_rng([seed, count])
    found: list[Planning] = []
    by_hand: list[float] = []
    while len(found) < tasks:
        known = _scene(rng, count)
        situation = Situation(robot_domain(), known)
        upper, lower = (f"o{number}" for number in rng.permutation(count)[:2])
        task = situation.task(situation.goal(f"on({upper}, {lower})"))
        planning = plan(task, PlanningLimits(every=True))
        if planning.outcome is not PlanOutcome.FOUND:
            continue
        started = time.process_time()
        expected = plans_by_hand(known, upper, lower)
        by_hand.append(time.process_time() - started)
        found.append(planning)
        if {tuple(map(str, each.actions)) for each in planning.plans} != expected:
            raise ReasoningError(f"the planner found other plans than {expected}: {planning}")
    return found, by_hand


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
