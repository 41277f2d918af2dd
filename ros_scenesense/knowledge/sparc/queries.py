"""Questions to a SPARC program: a literal, perhaps with variables, and what the answer to it is."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from enum import StrEnum

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.literals import Literal, variables_of
from ros_scenesense.knowledge.problems import Problems
from ros_scenesense.knowledge.sparc.checking import Checker
from ros_scenesense.knowledge.sparc.language import Program
from ros_scenesense.knowledge.sparc.sorts import Value, value_text
from ros_scenesense.knowledge.sparc.statements import arithmetics, is_anonymous
from ros_scenesense.knowledge.sparc.syntax import read_query
from ros_scenesense.knowledge.sparc.translation import matches
from ros_scenesense.knowledge.sparc.walking import evaluated
from ros_scenesense.knowledge.terms import Variable
from ros_scenesense.knowledge.texts import check_length


class Truth(StrEnum):
    """The answer to a literal: it, or its complement, or neither is in every answer set."""

    YES = "yes"
    NO = "no"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Query:
    """A literal that somebody asks for."""

    literal: Literal

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Its variables, but for `_`."""
        found = dict.fromkeys(variables_of(self.literal))
        return tuple(each for each in found if not is_anonymous(each))

    @property
    def is_ground(self) -> bool:
        """Whether it has no variables at all."""
        return not any(True for _ in variables_of(self.literal))


def parse_query(text: str, program: Program) -> Query:
    """Reads a literal such as `p(X)` or `-p(a)`.

    Raises:
        LanguageError: If it is none, or does not fit the program.
    """
    check_length(text, "query")
    problems = Problems()
    literal = read_query(text, program.text.constants, program.text.largest, problems)
    problems.check()
    if not isinstance(literal, Literal):
        raise LanguageError("query:1:1: found a sort, expected a literal, such as 'p(X)'")
    Checker(program.signature, program.text, problems).literal(literal)
    for arithmetic in arithmetics(literal.atom.arguments):
        if evaluated(arithmetic) is None:
            problems.add(arithmetic.place, f"found {arithmetic} in a query, expected plain terms")
    problems.check()
    return Query(literal)


def truth(query: Query, common: Collection[tuple[bool, Value]]) -> Truth:
    """The answer to a literal without variables.

    Args:
        query: What was asked.
        common: What all answer sets have in common: signs, and atoms as values.
    """
    for value in (query.literal.positive, not query.literal.positive):
        if any(sign == value and _matches(query, atom, {}) for sign, atom in common):
            return Truth.YES if value == query.literal.positive else Truth.NO
    return Truth.UNKNOWN


def bindings(query: Query, common: Collection[tuple[bool, Value]]) -> Iterator[str]:
    """For each way in which the literal is in every answer set, the values of its variables."""
    found: dict[str, None] = {}
    for sign, atom in common:
        values: dict[Variable, Value] = {}
        if sign == query.literal.positive and _matches(query, atom, values):
            pairs = (f"{each} = {value_text(values[each])}" for each in query.variables)
            found[", ".join(pairs) or "yes"] = None
    return iter(found)


def _matches(query: Query, atom: Value, values: dict[Variable, Value]) -> bool:
    name, arguments = query.literal.atom.name, query.literal.atom.arguments
    if not arguments:
        return atom == name
    if not isinstance(atom, tuple) or atom[0] != name or len(atom) != len(arguments) + 1:
        return False
    return all(
        matches(argument, value, values)
        for argument, value in zip(arguments, atom[1:], strict=True)
    )
