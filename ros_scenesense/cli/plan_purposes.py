"""`scenesense explain --goal`: why each action of the plan for a goal."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from ros_scenesense.cli.scene_source import scene_of
from ros_scenesense.errors import ParameterError, ReasoningError
from ros_scenesense.reasoning.planning import PlanningLimits
from ros_scenesense.reasoning.purposes import Purpose
from ros_scenesense.reasoning.situations import Situation, robot_domain
from ros_scenesense.stages.one_job import run_once
from ros_scenesense.stages.planning_engine import PlanningEngine, PlanReport
from ros_scenesense.stages.protocol import JobFailure

# Grounding cannot be interrupted: after this much more than it may search the process is killed.
_GRACE_S = 10.0


def explained_plan(
    arguments: argparse.Namespace, withheld: Sequence[str]
) -> tuple[tuple[Purpose, ...], dict[str, str]]:
    """The shortest plan with the purpose of each action, and the objects that are renamed.

    Raises:
        ReasoningError: If there is no plan to explain.
        ParameterError: If an axiom to leave out does not exist.
    """
    domain = robot_domain()
    unknown = [name for name in withheld if name not in domain.ids]
    if unknown:
        raise ParameterError(f"--without: there is no axiom {', '.join(unknown)}")
    situation = Situation(domain, scene_of(arguments), withheld)
    task = situation.task(situation.goal(arguments.goal))
    limits = PlanningLimits()
    deadline_s = limits.time_limit_s + _GRACE_S
    report = run_once(PlanningEngine, "plan_with_purposes", (task, limits), deadline_s)
    if isinstance(report, JobFailure):
        raise ReasoningError(report.reason)
    return _purposes(report), situation.renamed


def as_json(explained: Sequence[Purpose]) -> list[dict[str, Any]]:
    """The purposes as plain values."""
    return [
        {
            "step": each.step,
            "action": str(each.action),
            "enables": None if each.enables is None else str(each.enables),
            "enabled_step": each.enabled_step,
            "because": each.because,
            "achieves": [str(condition) for condition in each.achieves],
        }
        for each in explained
    ]


def _purposes(report: PlanReport) -> tuple[Purpose, ...]:
    if not report.planning.plans:
        reason = f": {report.obstacles}" if report.obstacles is not None else ""
        raise ReasoningError(f"there is no plan to explain{reason}")
    return report.purposes
