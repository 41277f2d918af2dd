"""What numbers a term can have, from the bounds of its sorts; clingo computes with 32 bits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from ros_scenesense.knowledge.literals import Comparison, Condition, terms_of
from ros_scenesense.knowledge.problems import Problems
from ros_scenesense.knowledge.signature import Signature
from ros_scenesense.knowledge.sorting import Head
from ros_scenesense.knowledge.terms import (
    LARGEST_NUMBER,
    Arithmetic,
    Number,
    Place,
    Record,
    Term,
    Variable,
)

Interval = tuple[int, int]
"""Lowest and highest value."""


def combined(operator: str, one: Interval, other: Interval) -> Interval:
    """What `one operator other` can be."""
    (low, high), (other_low, other_high) = one, other
    if operator == "/":
        largest = max(abs(low), abs(high))
        return -largest, largest
    if operator == "*":
        products = [x * y for x in one for y in other]
        return min(products), max(products)
    if operator == "+":
        return low + other_low, high + other_high
    return low - other_high, high - other_low


class Numbers:
    """Computes with intervals.

    Args:
        signature: The sorts.
        sorts: The sorts of each variable.
    """

    def __init__(
        self, signature: Signature, sorts: Mapping[Variable, Sequence[str]] | None = None
    ) -> None:
        self._signature = signature
        self._sorts = sorts or {}

    def within(self, sort: str) -> Interval | None:
        """Lowest and highest number of a sort; None if it has none."""
        found: list[int] = []
        for name in self._signature.family(sort):
            each = self._signature.sorts[name]
            found.extend(each.bounds or ())
            found.extend(member.value for member in each.members if isinstance(member, Number))
        return (min(found), max(found)) if found else None

    def check(
        self,
        heads: Iterable[Head],
        premises: Iterable[Condition],
        problems: Problems,
        place: Place | None,
    ) -> None:
        """Notes arithmetic on what is no number, and what may not fit 32 bits."""
        for part in (*heads, *premises):
            for term in terms_of(part):
                for arithmetic in _arithmetics(term):
                    self._interval(arithmetic, problems, place)
            if isinstance(part, Comparison) and part.operator not in ("=", "!="):
                for side in (part.left, part.right):
                    if not isinstance(side, Arithmetic) and self._of(side) is None:
                        problems.add(
                            side.place or place,
                            f"found {side} in {part}, expected a number: "
                            f"only numbers can be compared with '{part.operator}'",
                        )

    def _interval(
        self, term: Arithmetic, problems: Problems, place: Place | None
    ) -> Interval | None:
        sides = []
        for side in (term.left, term.right):
            if isinstance(side, Arithmetic):
                interval = self._interval(side, problems, place)
            else:
                interval = self._of(side)
                if interval is None:
                    problems.add(side.place or place, f"found {side} in {term}, expected a number")
            if interval is None:
                return None
            sides.append(interval)
        result = combined(term.operator, *sides)
        if max(abs(result[0]), abs(result[1])) > LARGEST_NUMBER:
            problems.add(
                term.place or place,
                f"{term} may be as large as {max(result, key=abs)}, expected at most "
                f"{LARGEST_NUMBER}: the solver computes with 32 bits",
            )
            return None
        return result

    def _of(self, term: Term) -> Interval | None:
        if isinstance(term, Number):
            return term.value, term.value
        if isinstance(term, Variable):
            intervals = [self.within(sort) for sort in self._sorts.get(term, ())]
            known = [each for each in intervals if each is not None]
            if known and len(known) == len(intervals):
                return max(low for low, _ in known), min(high for _, high in known)
        return None


def _arithmetics(term: Term) -> Iterator[Arithmetic]:
    """The outermost arithmetic in a term."""
    if isinstance(term, Arithmetic):
        yield term
    elif isinstance(term, Record):
        for argument in term.arguments:
            yield from _arithmetics(argument)
