"""Which instances of a program's rules hold in an answer set: the material of every explanation."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import clingo
from clingo import ast

from ros_scenesense.errors import ReasoningError
from ros_scenesense.reasoning.explanation.rules import FIRED, Rule


class Sign(Enum):
    """How a literal stands in a body."""

    HOLDS = 0
    FAILS = 1
    CONDITION = 2


@dataclass(frozen=True)
class GroundLiteral:
    """A literal of a grounded body.

    Attributes:
        sign: HOLDS for an atom that must be in the answer set, FAILS for one under `not`, CONDITION
            for what is decided by itself: comparisons, aggregates, conditional literals.
        atom: The atom, perhaps classically negated; a variable without a value, such as one that
            is local to a negated literal, is a string that begins with `_`. None for conditions.
        words: A condition as text.
    """

    sign: Sign
    atom: clingo.Symbol | None = None
    words: str = ""

    @classmethod
    def of(cls, term: clingo.Symbol) -> GroundLiteral:
        """Reads what `rules.literal_term` writes."""
        sign, *content = term.arguments
        if sign.number != Sign.CONDITION.value:
            return cls(Sign(sign.number), content[0])
        if len(content) == 1:
            return cls(Sign.CONDITION, words=content[0].string)
        words = [
            each.string if position % 2 else str(each) for position, each in enumerate(content)
        ]
        return cls(Sign.CONDITION, words=" ".join(words))


@dataclass(frozen=True)
class Instance:
    """A grounded rule whose body holds in the answer set.

    Attributes:
        rule: Index of the rule among the statements.
        head: The atom that it derives.
        body: Its body.
        chosen: Whether the head is a choice: the rule allows the atom, it does not force it.
    """

    rule: int
    head: clingo.Symbol
    body: tuple[GroundLiteral, ...]
    chosen: bool = False

    @property
    def needs(self) -> tuple[clingo.Symbol, ...]:
        """The atoms that must hold before the rule derives its head."""
        return tuple(
            each.atom for each in self.body if each.sign is Sign.HOLDS and each.atom is not None
        )


def instances(
    rules: Iterable[Rule], definitions: Iterable[ast.AST], answer: Collection[clingo.Symbol]
) -> list[Instance]:
    """All instances of rules whose bodies hold in an answer set, in the order of the rules.

    Args:
        rules: The rules.
        definitions: Constants that the rules use, `#const` statements.
        answer: The answer set, with the facts.

    Raises:
        ReasoningError: If the solver refuses the rules.
    """
    text = "\n".join(line for rule in rules for line in rule.rewritten())
    found = ground(text, definitions, answer, FIRED, 4)
    holds = frozenset(answer)
    return sorted(
        (
            Instance(
                rule=index.number,
                head=head,
                body=tuple(GroundLiteral.of(term) for term in body.arguments),
                chosen=bool(chosen.number),
            )
            for index, head, chosen, body in found
            # A choice allows more than was chosen.
            if head in holds
        ),
        key=lambda each: (each.rule, each.head),
    )


def atoms_of(text: str) -> list[clingo.Symbol]:
    """The atoms of a program that is made of facts.

    Raises:
        ReasoningError: If the solver refuses it.
    """
    control, words = _control()
    try:
        control.add("base", [], text)
        control.ground()
    except RuntimeError as error:
        raise ReasoningError("\n".join(words) or str(error)) from error
    return [each.symbol for each in control.symbolic_atoms if each.is_fact]


def ground(
    text: str,
    definitions: Iterable[ast.AST],
    answer: Collection[clingo.Symbol],
    predicate: str,
    arity: int,
) -> list[Sequence[clingo.Symbol]]:
    """Grounds rules over an answer set; the arguments of all atoms of one predicate.

    Raises:
        ReasoningError: If the solver refuses the rules.
    """
    control, words = _control()
    try:
        with ast.ProgramBuilder(control) as builder:
            for node in definitions:
                builder.add(node)
        control.add("base", [], text)
        with control.backend() as backend:
            for atom in answer:
                backend.add_rule([backend.add_atom(atom)])
        control.ground()
    except RuntimeError as error:
        raise ReasoningError("\n".join(words) or str(error)) from error
    return [atom.symbol.arguments for atom in control.symbolic_atoms.by_signature(predicate, arity)]


def _control() -> tuple[clingo.Control, list[str]]:
    words: list[str] = []
    return clingo.Control(logger=lambda _code, text: words.append(text.strip())), words
