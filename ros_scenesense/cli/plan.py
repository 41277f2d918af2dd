"""Find the actions that lead from a scene to a goal."""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ros_scenesense.cli.declared import add_declared, value_of
from ros_scenesense.cli.scene_source import add_scene_arguments, scene_of
from ros_scenesense.errors import ParameterError, SceneSenseError
from ros_scenesense.knowledge.action_language import load, parse_goal
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.parameters import Parameter
from ros_scenesense.reasoning.planning import (
    Aim,
    FoundPlan,
    PlanningLimits,
    PlanningTask,
    PlanOutcome,
)
from ros_scenesense.reasoning.situations import Situation, robot_domain
from ros_scenesense.stages.one_job import run_once
from ros_scenesense.stages.planning_engine import PlanningEngine, PlanReport
from ros_scenesense.stages.protocol import JobFailure

_EPILOG = """\
A goal is a list of literals, `on(red_can, white_cube), -occluded(red_box)`, perhaps with variables,
`no occluded(X)`, `all stable(X)`, `fewest on(X, table)`, or the name of a goal in the domain, such
as reduce_clutter. Exit code: 0 there is a plan, or the goal holds already; 1 there is none; 2
something is wrong; 3 time ran out. docs/planning.md has it all.
"""
_FOUND, _NONE, _WRONG, _TIMED_OUT = 0, 1, 2, 3
_HORIZON = Parameter("--horizon", int, 8, "longest plans", minimum=0, maximum=100)
_STEPS = Parameter("--max-steps", int, 20, "longest plans that are tried", minimum=1, maximum=100)
_MOST = Parameter("--max-plans", int, 1000, "plans to enumerate", minimum=1, maximum=1_000_000)
_SECONDS = Parameter(
    "--time-limit", float, 30.0, "seconds of searching", minimum=0.01, maximum=86_400.0
)
# Grounding cannot be interrupted: after this much more the process is killed.
_GRACE_S = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense plan`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    parser.add_argument("goal", metavar="GOAL", help="what is to hold in the end")
    add_scene_arguments(parser, required=False)
    parser.add_argument(
        "--domain",
        type=Path,
        metavar="FILE",
        help="a domain in the action language instead of the robot's; without --scene its own "
        "history says what holds at first",
    )
    parser.add_argument(
        "--without", metavar="IDS", default="", help="axioms to leave out, separated by commas"
    )
    aim = parser.add_mutually_exclusive_group()
    aim.add_argument(
        "--optimal",
        action="store_true",
        help="fewest exceptions to defaults first, then the shortest (default: the shortest)",
    )
    aim.add_argument(
        "--horizon",
        metavar="INT",
        help="all plans that reach the goal within so many steps are equally good",
    )
    parser.add_argument("--all", action="store_true", help="list all plans that are equally good")
    parser.add_argument("--count", action="store_true", help="only count these plans, by length")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    add_declared(parser, (_STEPS, _MOST, _SECONDS))


def run(arguments: argparse.Namespace) -> int:
    """Plans, and prints the answer."""
    try:
        return _run(arguments)
    except SceneSenseError as error:
        print(f"scenesense plan: {error}", file=sys.stderr)
        return _WRONG


def _run(arguments: argparse.Namespace) -> int:
    question = _question(arguments)
    limits = _limits(arguments)
    report = run_once(
        PlanningEngine, "plan", (question.task, limits), limits.time_limit_s + _GRACE_S
    )
    if isinstance(report, JobFailure):
        print(f"scenesense plan: {report.reason}", file=sys.stderr)
        return _TIMED_OUT if report.timed_out else _WRONG
    if arguments.json:
        print(json.dumps(_object(question, report), indent=2))
    else:
        for line in _lines(question, report, arguments.count):
            print(line)
    outcome = report.planning.outcome
    if outcome is PlanOutcome.TIMED_OUT:
        return _TIMED_OUT
    return _NONE if outcome is PlanOutcome.NO_PLAN else _FOUND


@dataclass(frozen=True)
class _Question:
    """What to plan, and the names of objects that are called otherwise in the domain."""

    task: PlanningTask
    renamed: dict[str, str]


def _question(arguments: argparse.Namespace) -> _Question:
    withheld = [name for name in arguments.without.replace(" ", "").split(",") if name]
    domain = robot_domain() if arguments.domain is None else load(arguments.domain).description
    unknown = [name for name in withheld if name not in domain.ids]
    if unknown:
        raise ParameterError(
            f"--without: {domain.source} has no axiom {', '.join(unknown)}; it has "
            f"{', '.join(domain.ids)}"
        )
    if arguments.scene is not None:
        situation = Situation(domain, scene_of(arguments), withheld)
        task = situation.task(situation.goal(arguments.goal))
        return _Question(task, situation.renamed)
    if arguments.domain is None:
        raise ParameterError("--scene is missing: from where should the plan start?")
    return _Question(_task_of(arguments.domain, arguments.goal, withheld), {})


def _task_of(domain: Path, goal: str, withheld: list[str]) -> PlanningTask:
    """The task in a domain whose own history says what holds at first."""
    loaded = load(domain)
    if loaded.history.happened or loaded.history.observations:
        raise ParameterError(
            f"--domain: {domain} says what happened or was observed (hpd, obs); a plan starts from "
            "what holds initially: leave the history out, or give the present state as --scene"
        )
    description: SystemDescription = loaded.description.without(withheld)
    return PlanningTask(description, loaded.history.initial, parse_goal(goal, description))


def _limits(arguments: argparse.Namespace) -> PlanningLimits:
    aim = Aim.SHORTEST
    if arguments.optimal:
        aim = Aim.OPTIMAL
    elif arguments.horizon is not None:
        aim = Aim.HORIZON
    return PlanningLimits(
        aim=aim,
        every=arguments.all or arguments.count,
        horizon=value_of(arguments, _HORIZON),
        max_steps=value_of(arguments, _STEPS),
        max_plans=value_of(arguments, _MOST),
        time_limit_s=value_of(arguments, _SECONDS),
    )


def _lines(question: _Question, report: PlanReport, count: bool) -> Iterator[str]:
    planning = report.planning
    yield f"goal: {question.task.goal}"
    for constant, name in question.renamed.items():
        yield f"{constant} stands for {name!r}"
    match planning.outcome:
        case PlanOutcome.REACHED:
            yield "The goal holds already."
            return
        case PlanOutcome.TIMED_OUT:
            yield f"Time ran out at step {planning.steps}; no plan is shorter than that."
            return
        case PlanOutcome.NO_PLAN:
            yield f"There is no plan up to step {planning.steps}."
            if report.obstacles is not None and str(report.obstacles):
                yield f"In the way: {report.obstacles}"
            return
    if count:
        yield from _counts(planning.plans)
    else:
        for number, found in enumerate(planning.plans, start=1):
            yield from _plan_lines(found, number, len(planning.plans))
    if not planning.complete:
        yield f"There may be better or more plans: it ended at step {planning.steps} by a limit."


def _plan_lines(found: FoundPlan, number: int, of: int) -> Iterator[str]:
    title = f"plan {number} of {of}" if of > 1 else "plan"
    yield f"{title}, {len(found.actions)} action{'s' if len(found.actions) > 1 else ''}:"
    for step, action in enumerate(found.actions):
        yield f"  {step:>2}  {action}"
    for literal, step in found.exceptions:
        yield f"  taken as an exception to defaults: {literal} after step {step - 1}"


def _counts(plans: tuple[FoundPlan, ...]) -> Iterator[str]:
    lengths = Counter(len(found.actions) for found in plans)
    for length, number in sorted(lengths.items()):
        yield f"{number:>8} plan{'s' if number > 1 else ' '} of {length} actions"
    yield f"{len(plans):>8} in all"


def _object(question: _Question, report: PlanReport) -> dict[str, Any]:
    planning = report.planning
    lengths = Counter(len(found.actions) for found in planning.plans)
    return {
        "goal": str(question.task.goal),
        "outcome": planning.outcome.value,
        "plans": [
            {
                "actions": list(map(str, found.actions)),
                "exceptions": [
                    {"literal": str(literal), "step": step} for literal, step in found.exceptions
                ],
            }
            for found in planning.plans
        ],
        "counts": {str(length): number for length, number in sorted(lengths.items())},
        "complete": planning.complete,
        "steps": planning.steps,
        "reason": str(report.obstacles) if report.obstacles is not None else "",
        "names": question.renamed,
        "cpu_seconds": round(planning.seconds, 4),
    }
