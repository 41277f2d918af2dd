"""What is said about a goal that is pursued: actions and outcomes in words, states as messages."""

from __future__ import annotations

from ros_scenesense.messages.actions import Action, PlannedAction, StateLiteral
from ros_scenesense.reasoning.described_scenes import TABLE
from ros_scenesense.reasoning.projection import State
from ros_scenesense.reasoning.situations import Situation
from ros_scenesense.stages.planning_engine import OutcomeReport


def words_of(action: PlannedAction) -> str:
    """An action, e.g. `putdown(duck, table)`."""
    if action.kind == "pickup":
        return f"pickup({action.object})"
    return f"putdown({action.object}, {action.location or TABLE})"


def unexpected(action: Action, report: OutcomeReport) -> str:
    """What was seen otherwise than expected, and why; empty if nothing was."""
    if not report.surprises:
        return ""
    seen = [str(each) for each in report.surprises if each.positive]
    missed = [str(each.atom) for each in report.surprises if not each.positive]
    words = f"after {words_of(action.action)}"
    if missed:
        words += f" {', '.join(missed)} was expected"
    if seen:
        words += f"{' but' if missed else ''} {', '.join(seen)} was seen"
    explanations = report.diagnosis.explanations if report.diagnosis is not None else ()
    if not explanations:
        return f"{words}, which nothing explains that the domain knows of"
    causes = (" and ".join(str(event.action) for event in each) for each in explanations)
    return f"{words}: {' or '.join(causes)}"


def literals_of(state: State, situation: Situation) -> list[StateLiteral]:
    """The literals of a state, sorted, with the objects' own names."""
    return [
        StateLiteral(
            fluent=each.atom.name,
            arguments=[situation.name(argument)[:64] for argument in each.atom.arguments],
            holds=each.positive,
        )
        for each in sorted(state, key=str)
    ]
