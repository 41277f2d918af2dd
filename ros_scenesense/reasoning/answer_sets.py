"""The answer sets of a whole program: what `scenesense solve` computes.

Only optimal answer sets are answers, and those that agree on what is shown are one. A program with
CR rules is solved without them first; they come in only where it has no answer set, and then as few
as possible are applied (CR-Prolog, paper section on ASP; the program minimises them above all).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import clingo

from ros_scenesense.reasoning.program import Messages


class Outcome(StrEnum):
    """How solving ended."""

    SATISFIABLE = "satisfiable"
    UNSATISFIABLE = "unsatisfiable"
    TIMED_OUT = "timed out"


@dataclass(frozen=True)
class Question:
    """A program and what is asked of it.

    Attributes:
        text: Program text; our own or generated.
        files: Paths of programs, which are read where they stand.
        restoring: Whether the program has CR rules, which its constant `restore` switches.
        applied: In a program whose CR rules are choices that it minimises: the unary predicate of
            those that are applied. They are first assumed not to be; nothing is grounded twice.
            What else the program minimises has to be optimal, too; if that is nothing, `optimize`
            should not be set, since then there are faster ways.
        models: How many answer sets to find; 0 for all.
        optimize: Whether only optimal answer sets are answers, if the program optimises.
        constants: Values of the program's constants, as `name=value`.
        common: Whether to find what all answer sets have in common, instead of the sets.
        time_limit_s: Time for all of it. The search ends in time; grounding cannot be interrupted,
            so whoever asks has to be ready to kill the process.
    """

    text: str = ""
    files: tuple[str, ...] = ()
    restoring: bool = False
    applied: str = ""
    models: int = 1
    optimize: bool = True
    constants: tuple[str, ...] = ()
    common: bool = False
    time_limit_s: float = 60.0


@dataclass(frozen=True)
class AnswerSets:
    """The answer to a question.

    Attributes:
        outcome: How it ended.
        sets: The answer sets, each as the sorted texts of its shown literals.
        costs: What the program minimises, by falling priority; empty if it does not.
        complete: Whether there are no more answer sets than these.
        restored: Whether CR rules had to come in.
        messages: What clingo had to say about the program.
    """

    outcome: Outcome
    sets: tuple[tuple[str, ...], ...] = ()
    costs: tuple[int, ...] = ()
    complete: bool = False
    restored: bool = False
    messages: tuple[str, ...] = ()


class AnswerSetEngine:
    """Solves programs; remembers nothing between two calls."""

    def consequences(self, question: Question) -> AnswerSets:
        """The shown literals that all answer sets have in common, as the only set.

        They are computed without looking at every answer set. Where an answer set is no answer
        because it is not optimal or applies too many CR rules, it does not count here either.

        Raises:
            ReasoningError: If the program is broken or the solver fails; the text says where.
        """
        return self.solve(replace(question, models=0, common=True))

    def solve(self, question: Question) -> AnswerSets:
        """Grounds and solves.

        Raises:
            ReasoningError: If the program is broken or the solver fails; the text says where.
        """
        deadline = time.monotonic() + question.time_limit_s
        if question.applied:
            return _solve_assuming(question, deadline)
        if not question.restoring:
            return _solve(question, deadline, ())
        plain = _solve(question, deadline, ("-c", "restore=0"))
        if plain.outcome is not Outcome.UNSATISFIABLE:
            return plain
        restored = _solve(question, deadline, ("-c", "restore=1"))
        return restored if restored.outcome is Outcome.UNSATISFIABLE else _with_cr(restored)


def _with_cr(answers: AnswerSets) -> AnswerSets:
    return replace(answers, restored=True)


def _solve(question: Question, deadline: float, switches: Sequence[str]) -> AnswerSets:
    mode = "optN" if question.optimize or question.restoring else "ignore"
    with Messages("program") as messages:
        control = _grounded(question, messages, (f"--opt-mode={mode}", *switches))
        answers = _search(control, question, deadline)
    return replace(answers, messages=tuple(messages.words))


def _solve_assuming(question: Question, deadline: float) -> AnswerSets:
    with Messages("program") as messages:
        control = _grounded(question, messages, ("--opt-mode=optN",))
        instances = control.symbolic_atoms.by_signature(question.applied, 1)
        answers = _search(control, question, deadline, [(each.symbol, False) for each in instances])
        if answers.outcome is Outcome.UNSATISFIABLE:
            if not question.optimize:
                # Mostly few rules are enough: a search from below finds them without detours.
                solvers = control.configuration.solver
                assert isinstance(solvers, clingo.Configuration)
                solvers.opt_strategy = "usc"
            answers = _search(control, question, deadline)
            if answers.outcome is not Outcome.UNSATISFIABLE:
                answers = _with_cr(answers)
    return replace(answers, messages=tuple(messages.words))


def _grounded(question: Question, messages: Messages, options: Sequence[str]) -> clingo.Control:
    arguments = ["0", *options, *(["--enum-mode=cautious"] if question.common else [])]
    for constant in question.constants:
        arguments += ["-c", constant]
    control = clingo.Control(arguments, logger=messages.take)
    for path in question.files:
        control.load(path)
    if question.text:
        control.add("base", [], question.text)
    control.ground()
    return control


def _search(
    control: clingo.Control,
    question: Question,
    deadline: float,
    assumptions: Sequence[tuple[clingo.Symbol, bool]] = (),
) -> AnswerSets:
    found = _Found(question)
    # The solver calls back. Handing over each of thousands of models takes longer than finding it.
    with control.solve(assumptions, on_model=found.take, async_=True) as handle:
        if not handle.wait(max(0.0, deadline - time.monotonic())):
            handle.cancel()
            return AnswerSets(Outcome.TIMED_OUT, found.sets(), found.costs)
        complete = bool(handle.get().exhausted)
    sets = found.sets()
    return AnswerSets(
        Outcome.SATISFIABLE if sets else Outcome.UNSATISFIABLE, sets, found.costs, complete
    )


class _Found:
    """Takes models and keeps what is an answer.

    Thousands of models are made of the same few atoms: these are numbered as they come, and
    compared and written once, at the end.
    """

    def __init__(self, question: Question) -> None:
        self._question = question
        self._optimal = bool(question.optimize or question.restoring or question.applied)
        self._numbers: dict[clingo.Symbol, int] = {}
        self._sets: dict[tuple[int, ...], None] = {}
        self.costs: tuple[int, ...] = ()

    def take(self, model: clingo.Model) -> bool:
        """Takes a model; False if there are enough."""
        if self._optimal and model.cost:
            if not model.optimality_proven:
                return True
            self.costs = tuple(model.cost)
        if self._question.common:
            self._sets.clear()  # each model is what is left so far
        numbers = self._numbers
        shown = [numbers.setdefault(each, len(numbers)) for each in model.symbols(shown=True)]
        self._sets[tuple(sorted(shown))] = None
        return len(self._sets) != self._question.models

    def sets(self) -> tuple[tuple[str, ...], ...]:
        """The answer sets in the order they were found, each in clingo's order of terms."""
        ordered = sorted(self._numbers)
        texts = list(map(str, ordered))
        ranks = [0] * len(ordered)
        for rank, symbol in enumerate(ordered):
            ranks[self._numbers[symbol]] = rank
        return tuple(
            tuple(texts[rank] for rank in sorted(ranks[number] for number in each))
            for each in self._sets
        )
