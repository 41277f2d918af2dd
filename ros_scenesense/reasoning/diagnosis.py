"""Diagnosis: what must have happened without the robot, so that it saw what it saw.

A history whose observations do not follow from what the robot did is inconsistent. Its explanations
are the smallest sets of exogenous actions that restore consistency, each one application of a CR
rule (paper, *Knowledge Representation and Reasoning*: observations that are not expected).
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import cast

import clingo

from ros_scenesense.knowledge.description import History, SystemDescription
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.transition_program import TransitionProgram
from ros_scenesense.reasoning.atoms import atom_of
from ros_scenesense.reasoning.patience import Patience
from ros_scenesense.reasoning.program import Messages


class DiagnosisOutcome(StrEnum):
    """What became of a diagnosis.

    `EXPECTED`: all observations follow from what the robot did. `UNEXPLAINED`: no exogenous actions
    of the domain explain them.
    """

    EXPECTED = "expected"
    EXPLAINED = "explained"
    UNEXPLAINED = "unexplained"
    TIMED_OUT = "timed_out"


@dataclass(frozen=True)
class Event:
    """An exogenous action, and the step at which it happened, together with what the robot did."""

    action: Atom
    step: int

    def __str__(self) -> str:
        return f"{self.action} at step {self.step}"


@dataclass(frozen=True)
class Diagnosis:
    """The smallest explanations of a history.

    Attributes:
        outcome: How it ended.
        explanations: Each a set of events, in order; all have equally many, and none is missing
            unless `complete` is False. The empty one if everything was expected.
        complete: Whether these are all.
        seconds: CPU time it took.
    """

    outcome: DiagnosisOutcome
    explanations: tuple[tuple[Event, ...], ...] = ()
    complete: bool = True
    seconds: float = 0.0


def diagnose(
    description: SystemDescription,
    history: History,
    time_limit_s: float = 5.0,
    most: int = 100,
) -> Diagnosis:
    """Explains a history.

    Args:
        description: The domain with the members of its sorts and the values of its statics.
        history: What was true at first (inertial fluents that are not named are false), what the
            robot did at each step from 0 on, and what was observed.
        time_limit_s: Searching ends here. Grounding cannot be interrupted.
        most: As many explanations are listed at most.

    Raises:
        ReasoningError: If the solver fails.
    """
    started = time.process_time()
    with Messages("diagnosis program") as messages:
        search = _Search(description, history, most, messages)
        with Patience(search.control, time_limit_s) as patience:
            explanations, complete = search.run(patience)
        complete &= not patience.is_over
    if explanations:
        expected = not explanations[0]
        outcome = DiagnosisOutcome.EXPECTED if expected else DiagnosisOutcome.EXPLAINED
    else:
        outcome = DiagnosisOutcome.UNEXPLAINED if complete else DiagnosisOutcome.TIMED_OUT
    return Diagnosis(
        outcome, tuple(sorted(explanations, key=str)), complete, time.process_time() - started
    )


class _Search:
    def __init__(
        self,
        description: SystemDescription,
        history: History,
        most: int,
        messages: Messages,
    ) -> None:
        asked = [Literal(each.fluent) for each in history.observations]
        self._history = history
        self._most = most
        self._program = TransitionProgram(description, asked, history.initial, exogenous=True)
        self.control = clingo.Control(logger=messages.take)
        solving = cast(clingo.Configuration, self.control.configuration.solve)
        solving.models = most + 1
        solving.opt_mode = "optN"

    def run(self, patience: Patience) -> tuple[list[tuple[Event, ...]], bool]:
        """All smallest explanations, and whether that is so."""
        steps = self._history.last_step
        self.control.add("base", [], "\n".join(self._parts()))
        grounded: list[tuple[str, Sequence[clingo.Symbol]]] = [("base", [])]
        for step in range(steps + 1):
            names = ["state"] if step == 0 else ["step", "exogenous", "state"]
            grounded += [(name, [clingo.Number(step)]) for name in names]
        self.control.ground(grounded)
        found: list[tuple[Event, ...]] = []
        if patience.is_over:
            return found, False
        with self.control.solve(yield_=True) as handle:
            for model in handle:
                if not model.optimality_proven:
                    continue
                found.append(tuple(sorted(self._events(model), key=_order)))
                if len(found) > self._most:
                    return found[:-1], False
            return found, not handle.get().interrupted

    def _parts(self) -> Iterator[str]:
        program = self._program
        yield program.text()
        yield program.exogenous()
        yield "#program base."
        for done in self._history.happened:
            yield f"{program.occurring(done.action, str(done.step + 1))}."
        for seen in self._history.observations:
            yield program.observed(Literal(seen.fluent, seen.value), seen.step)
        yield f"#show {program.helper('happened')}/2."

    def _events(self, model: clingo.Model) -> Iterator[Event]:
        for symbol in model.symbols(shown=True):
            action, step = symbol.arguments
            yield Event(atom_of(action), step.number - 1)


def _order(event: Event) -> tuple[int, str]:
    return event.step, str(event.action)
