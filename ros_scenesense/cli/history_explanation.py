"""`scenesense explain --domain`: why something is believed of a domain with a history."""

from __future__ import annotations

import argparse
from typing import Any

from ros_scenesense.cli.domain_files import load_domain
from ros_scenesense.errors import ReasoningError
from ros_scenesense.knowledge.translation import Options
from ros_scenesense.reasoning.explanation.histories import (
    HistoryExplanation,
    HistoryExplanationEngine,
)
from ros_scenesense.reasoning.explanation.text import outline
from ros_scenesense.stages.one_job import run_once
from ros_scenesense.stages.protocol import JobFailure

# Grounding and the search for the first answer set; nobody waits longer for an explanation.
_DEADLINE_S = 60.0


def explained_history(arguments: argparse.Namespace) -> HistoryExplanation:
    """Solves and explains in a process that is killed if it takes too long.

    Raises:
        SceneSenseError: If a file, the literal or the step is wrong, or there is no answer set.
    """
    domain = load_domain(arguments.domain, arguments.without)
    work = (domain, Options(), arguments.literal.strip(), arguments.step)
    result = run_once(HistoryExplanationEngine, "explain", work, _DEADLINE_S)
    if isinstance(result, JobFailure):
        raise ReasoningError(result.reason)
    explained: HistoryExplanation = result
    return explained


def words(explained: HistoryExplanation) -> str:
    """The explanation as text."""
    lines = [outline(explained.reason)]
    if explained.restored:
        lines.append("CR rules were applied: without them the history contradicts the domain.")
    if explained.others:
        lines.append("There are other answer sets; this is about the first.")
    return "\n".join(lines)


def as_json(explained: HistoryExplanation) -> dict[str, Any]:
    """The explanation as plain values."""
    return {
        "literal": explained.literal,
        "step": explained.step,
        "holds": explained.holds,
        "explanation": explained.reason.as_json(),
        "restored": explained.restored,
        "others": explained.others,
    }
