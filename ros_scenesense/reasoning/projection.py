"""Projection: the states that follow from what is true at first and what the robot does."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import clingo

from ros_scenesense.errors import ReasoningError
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.terms import Variable
from ros_scenesense.knowledge.transition_program import TransitionProgram
from ros_scenesense.reasoning.atoms import term_of
from ros_scenesense.reasoning.program import Messages

State = frozenset[Literal]
"""The literals of some attributes that are believed in a state: what is true and, of estimated
fluents, also what is false."""


def project(
    description: SystemDescription,
    initial: Iterable[Literal],
    actions: Sequence[Atom],
    watched: Collection[str],
) -> tuple[State, ...]:
    """The state in the beginning and after each action, if nothing happens without the robot.

    The actions are taken to have been done, also where the domain says that they are impossible.

    Args:
        description: The domain with the members of its sorts and the values of its statics.
        initial: What is true at first; inertial fluents that are not named are false.
        actions: What the robot does.
        watched: Names of the fluents to tell of. Of two converse relations only the one that is
            declared first is told.

    Raises:
        ReasoningError: If there is no such state, or the solver fails.
    """
    asked = [Literal(_general(description, name)) for name in watched]
    program = TransitionProgram(description, asked, initial, lenient=True)
    done = [f"{program.occurring(each, str(step + 1))}." for step, each in enumerate(actions)]
    with Messages("projection program") as messages:
        control = clingo.Control(["--opt-mode=ignore"], logger=messages.take)
        control.add("base", [], "\n".join([program.text(), "#program base.", *done]))
        grounded: list[tuple[str, Sequence[clingo.Symbol]]] = [("base", [])]
        for step in range(len(actions) + 1):
            parts = ["state"] if step == 0 else ["step", "state"]
            grounded += [(part, [clingo.Number(step)]) for part in parts]
        control.ground(grounded)
        with control.solve(yield_=True) as handle:
            model = handle.model()
            if model is None:
                raise ReasoningError(
                    "what was seen and what the domain says contradict each other: no state follows"
                )
            return _states(program, model, len(actions), watched)


def _states(
    program: TransitionProgram, model: clingo.Model, last: int, watched: Collection[str]
) -> tuple[State, ...]:
    states: list[set[Literal]] = [set() for _ in range(last + 1)]
    names = {name: (name, True) for name in watched}
    names |= {program.helper(f"no_{name}"): (name, False) for name in watched}
    for symbol in model.symbols(atoms=True):
        if symbol.positive and symbol.name in names:
            name, positive = names[symbol.name]
            *arguments, step = symbol.arguments
            atom = Atom(name, tuple(map(term_of, arguments)))
            states[step.number].add(Literal(atom, positive))
    return tuple(map(frozenset, states))


def _general(description: SystemDescription, name: str) -> Atom:
    count = len(description.signature.attributes[name].arguments)
    return Atom(name, tuple(Variable(f"X{index}") for index in range(count)))
