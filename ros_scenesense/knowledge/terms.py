"""Terms: what the arguments of literals are made of. Frozen, hashable, written as in the language.

Names are checked where terms are made, so that a term can be written into a program whatever it
was made from. `str` of a term is its text, in the action language and in clingo's alike.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

from ros_scenesense.errors import LanguageError

LARGEST_NUMBER = 2**31 - 1
"""clingo computes with 32 bits."""

_CONSTANT = re.compile(r"_*[a-z][A-Za-z0-9_]*", re.ASCII)
_VARIABLE = re.compile(r"_*[A-Z][A-Za-z0-9_]*", re.ASCII)
LONGEST_NAME = 200


class Place(NamedTuple):
    """Where something stands in a text: the file, and line and column counted from 1."""

    source: str
    line: int
    column: int

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}"


@lru_cache(maxsize=10_000)  # a text has few names, and thousands of terms
def check_name(name: str) -> None:
    """Checks the name of a constant, sort, fluent, action or record.

    Raises:
        LanguageError: If it is none.
    """
    if not _CONSTANT.fullmatch(name) or name == "not" or len(name) > LONGEST_NAME:
        raise LanguageError(
            f"{_shortened(name)} is no name: names begin with a small letter, hold letters, digits "
            f"and underscores, and are at most {LONGEST_NAME} long"
        )


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable; begins with a capital letter.

    Raises:
        LanguageError: If the name is none of a variable.
    """

    name: str
    place: Place | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        _check_variable(self.name)

    def __str__(self) -> str:
        return self.name


@lru_cache(maxsize=10_000)
def _check_variable(name: str) -> None:
    if not _VARIABLE.fullmatch(name) or len(name) > LONGEST_NAME:
        raise LanguageError(
            f"{_shortened(name)} is no variable: variables begin with a capital letter"
        )


@dataclass(frozen=True, slots=True)
class Constant:
    """A constant such as `red_can`.

    Raises:
        LanguageError: If the name is none of a constant.
    """

    name: str
    place: Place | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        check_name(self.name)

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Number:
    """A whole number.

    Raises:
        LanguageError: If it has more than 32 bits.
    """

    value: int
    place: Place | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if abs(self.value) > LARGEST_NUMBER:
            raise LanguageError(f"{_shortened(str(self.value))} is beyond {LARGEST_NUMBER}")

    def __str__(self) -> str:
        return str(self.value)


@dataclass(frozen=True, slots=True)
class Record:
    """A record such as `cell(1, 2)`.

    Raises:
        LanguageError: If the functor is no name.
    """

    functor: str
    arguments: tuple[Term, ...]
    place: Place | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        check_name(self.functor)

    def __str__(self) -> str:
        return f"{self.functor}({', '.join(map(str, self.arguments))})"


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """`left operator right`, with + - * or / (whole division, towards zero)."""

    operator: str
    left: Term
    right: Term
    place: Place | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.operator not in ("+", "-", "*", "/"):
            raise LanguageError(f"{_shortened(self.operator)} is no operator: + - * /")

    def __str__(self) -> str:
        left, right = (
            f"({side})" if isinstance(side, Arithmetic) else str(side)
            for side in (self.left, self.right)
        )
        return f"{left} {self.operator} {right}"


Term = Variable | Constant | Number | Record | Arithmetic
Symbol = Constant | Number | Record
"""A term without variables and arithmetic: what a sort has as members."""


def variables(term: Term) -> Iterator[Variable]:
    """The variables of a term, from left to right, as often as they occur."""
    found: list[Variable] = []
    collect_variables((term,), found)
    return iter(found)


def collect_variables(terms: Iterable[Term], found: list[Variable]) -> None:
    """Appends the variables of terms; generators inside generators would take most of the time."""
    for term in terms:
        if isinstance(term, Variable):
            found.append(term)
        elif isinstance(term, Record):
            collect_variables(term.arguments, found)
        elif isinstance(term, Arithmetic):
            collect_variables((term.left, term.right), found)


def _shortened(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:60] + "…")
