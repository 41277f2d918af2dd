"""CR rules about perception: which perceived relations are wrong, where a scene is inconsistent.

Applied only to scenes that contradict the knowledge, as CR rules are (paper, *Knowledge
Representation and Reasoning in ASP*): the smallest set of withdrawn relations that restores
consistency, and of equally small ones the one with the least confidence. Where several are equally
good, what holds whichever of them is right is believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import clingo

from ros_scenesense.reasoning.facts import PerceivedRelation, SceneFacts
from ros_scenesense.reasoning.program import Messages, Selection, add, read_program
from ros_scenesense.reasoning.solving import CAUTIOUS, QUIET, Consequences, Outcome, solve


@dataclass(frozen=True)
class Retraction:
    """How consistency was restored.

    Attributes:
        outcome: NO_ANSWER_SET if withdrawing relations does not help.
        believed: Shown atoms that hold in all best explanations.
        relations: Relations that are withdrawn in one of the best explanations at least.
        chosen: Of these, indices among the perceived relations, those of one best explanation.
    """

    outcome: Outcome
    believed: Sequence[clingo.Symbol] = ()
    relations: tuple[PerceivedRelation, ...] = ()
    chosen: frozenset[int] = frozenset()


def retract(
    facts: SceneFacts, selection: Selection, source: str, time_limit_s: float
) -> Retraction:
    """Finds the best explanations of a scene that contradicts the knowledge.

    Args:
        facts: The scene.
        selection: The statements in force.
        source: Name of the program, for messages.
        time_limit_s: Limit of each of three searches.

    Raises:
        ReasoningError: If the solver fails.
    """
    with Messages(source) as messages:
        control = _grounded(facts, selection, CAUTIOUS, messages)
        surely = solve(control, time_limit_s)
        if surely.outcome is not Outcome.FOUND:
            return Retraction(surely.outcome)
        configuration: Any = control.configuration.solve
        configuration.enum_mode = "brave"
        perhaps = solve(control, time_limit_s)
        # The last of its models is a best one.
        one = solve(_grounded(facts, selection, QUIET, messages), time_limit_s)
        for each in (perhaps, one):
            if each.outcome is not Outcome.FOUND:
                return Retraction(each.outcome)
    relations = facts.perceived(selection.used)
    return Retraction(
        Outcome.FOUND,
        believed=surely.symbols,
        relations=tuple(relations[index] for index in sorted(_withdrawn(perhaps))),
        chosen=frozenset(_withdrawn(one)),
    )


def _grounded(
    facts: SceneFacts, selection: Selection, arguments: Sequence[str], messages: Messages
) -> clingo.Control:
    control = clingo.Control(arguments, logger=messages.take)
    add(selection.open, control)
    control.add("base", [], read_program("retraction.lp"))
    control.add("base", [], facts.render(selection, retractable=True))
    control.ground()
    return control


def _withdrawn(consequences: Consequences) -> list[int]:
    return [each.arguments[0].number for each in consequences.symbols if each.name == "retracted"]
