"""From the definitions of sorts and the declarations of predicates to a signature."""

from __future__ import annotations

import itertools
import operator
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from ros_scenesense.knowledge.problems import Problems, nearest
from ros_scenesense.knowledge.sparc.sorts import (
    MOST_MEMBERS,
    Extent,
    Filtered,
    Listed,
    Numbers,
    Recorded,
    Sort,
    Union,
    Value,
    identifiers,
    value_of,
)
from ros_scenesense.knowledge.sparc.statements import (
    Combined,
    Concatenation,
    Expression,
    Members,
    Named,
    Range,
    Records,
    Related,
    SortDefinition,
    Text,
    arithmetics,
)
from ros_scenesense.knowledge.terms import Arithmetic, Place, Variable, variables

NAT = "nat"
"""The built-in sort: numbers from 0 to `#maxint`."""

_COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_DEEPEST = 100
_IDENTIFIER = re.compile(r"[a-z][A-Za-z0-9_]*")
_NUMBER = re.compile(r"0|[1-9][0-9]*")


@dataclass(frozen=True)
class Signature:
    """Sorts by name without `#`; predicates with the sorts of their arguments."""

    sorts: dict[str, Sort]
    predicates: dict[str, tuple[Sort, ...]]
    largest: int

    @property
    def nat(self) -> Sort:
        """The numbers from 0 to `#maxint`."""
        return self.sorts[NAT]


def declared(text: Text, problems: Problems) -> Signature:
    """The signature of a program; what is wrong with it is noted."""
    sorts = _Sorts(text, problems).sorts
    predicates: dict[str, tuple[Sort, ...]] = {}
    places: dict[str, Place] = {}
    for each in text.predicates:
        if each.name in places:
            problems.add(
                each.place, f"predicate '{each.name}' is declared already, at {places[each.name]}"
            )
            continue
        places[each.name] = each.place
        for sort in each.sorts:
            if sort.name not in sorts:
                _unknown(sort, sorts, text, problems)
        predicates[each.name] = tuple(sorts.get(sort.name, _ANYTHING) for sort in each.sorts)
    return Signature(sorts, predicates, text.largest)


class _Anything(Extent):
    """What is not known, since it was not defined as it should; everything fits."""

    @property
    def size(self) -> int:
        return MOST_MEMBERS

    def __contains__(self, value: object) -> bool:
        return True

    def __iter__(self) -> Iterator[Value]:
        return iter(())

    @property
    def interval(self) -> tuple[int, int] | None:
        return 0, 1


_ANYTHING = Sort("anything", _Anything())


def is_unknown(sort: Extent) -> bool:
    """Whether the sort was not defined as it should; nothing is to be said about it."""
    return sort is _ANYTHING or (isinstance(sort, Sort) and isinstance(sort.extent, _Anything))


def _unknown(name: Named, sorts: Iterable[str], text: Text, problems: Problems) -> None:
    if name.name not in text.unread:
        hint = nearest(name.name, tuple(sorts)).replace("mean '", "mean '#")
        problems.add(name.place, f"sort '#{name.name}' is not defined{hint}")


class _Sorts:
    def __init__(self, text: Text, problems: Problems) -> None:
        self._text = text
        self._problems = problems
        self.sorts = {NAT: Sort(NAT, Numbers(0, text.largest))}
        self._definitions: dict[str, SortDefinition] = {}
        for each in text.sorts:
            if each.name == NAT:
                problems.add(each.place, "sort '#nat' is built in; expected another name")
            elif each.name in self._definitions:
                first = self._definitions[each.name].place
                problems.add(each.place, f"sort '#{each.name}' is defined already, at {first}")
            else:
                self._definitions[each.name] = each
                self.sorts[each.name] = Sort(each.name)
        self._check_recursion()
        self._depths = {NAT: 0}
        for name, definition in self._ordered():
            self._define(name, definition)

    def _define(self, name: str, definition: SortDefinition) -> None:
        extent = self._extent(definition.expression)
        self.sorts[name].extent = extent
        used = [self._depths.get(each.name, 0) for each in _used(definition.expression)]
        self._depths[name] = 1 + max(used, default=0)
        if self._depths[name] == _DEEPEST:
            self._problems.add(
                definition.place, f"sort '#{name}' builds on {_DEEPEST} others, one upon another"
            )
        if self._depths[name] >= _DEEPEST:
            self.sorts[name].extent = extent = _Anything()
        if isinstance(extent, _Anything):
            return
        if extent.size > MOST_MEMBERS:
            self._problems.add(
                definition.place,
                f"sort '#{name}' has up to {extent.size} members, expected at most {MOST_MEMBERS}",
            )
        elif not any(True for _ in extent):
            self._problems.add(
                definition.place, f"sort '#{name}' is empty; expected at least one member"
            )

    def _ordered(self) -> Iterator[tuple[str, SortDefinition]]:
        """The definitions, each after those that it uses."""
        done: set[str] = set()

        def visit(name: str) -> Iterator[tuple[str, SortDefinition]]:
            stack = [(name, iter(_used(self._definitions[name].expression)))]
            done.add(name)
            while stack:
                current, rest = stack[-1]
                following = next(
                    (each.name for each in rest if each.name in self._definitions), None
                )
                if following is None:
                    stack.pop()
                    yield current, self._definitions[current]
                elif following not in done:
                    done.add(following)
                    used = _used(self._definitions[following].expression)
                    stack.append((following, iter(used)))

        for name in self._definitions:
            if name not in done:
                yield from visit(name)

    def _check_recursion(self) -> None:
        for name, definition in list(self._definitions.items()):
            seen: set[str] = set()
            fresh = [each.name for each in _used(definition.expression)]
            while fresh:
                following = fresh.pop()
                if following in self._definitions and following not in seen:
                    seen.add(following)
                    used = _used(self._definitions[following].expression)
                    fresh += [each.name for each in used]
            if name in seen:
                self._problems.add(
                    definition.place, f"sort '#{name}' is defined by itself; expected other sorts"
                )
                del self._definitions[name]
                self.sorts[name].extent = _Anything()

    def _extent(self, expression: Expression) -> Extent:
        match expression:
            case Named(name):
                if name in self.sorts:
                    sort = self.sorts[name]
                    return sort.extent if isinstance(sort.extent, _Anything) else sort
                _unknown(expression, self.sorts, self._text, self._problems)
                return _Anything()
            case Range(low, high, place):
                return self._range(low, high, place)
            case Members():
                return self._members(expression)
            case Records():
                return self._records(expression)
            case Concatenation():
                return self._concatenation(expression)
            case Combined(sign, parts):
                extents = [self._extent(part) for part in parts]
                if any(isinstance(each, _Anything) for each in extents):
                    return _Anything()
                if sign == "+":
                    return Union(tuple(extents))
                return Filtered(extents[0], extents[1], inside=sign == "*")

    def _range(self, low: int | str, high: int | str, place: Place) -> Extent:
        if isinstance(low, int) and isinstance(high, int):
            if low <= high:
                return Numbers(low, high)
            words = f"range {low}..{high} is upside down, expected {high}..{low}"
        elif isinstance(low, int) or isinstance(high, int):
            other = high if isinstance(low, int) else low
            words = f"'{other}' in range {low}..{high} is no constant, expected a number"
        elif len(low) > len(high):
            words = f"range {low}..{high} is upside down: '{low}' is longer than '{high}'"
        elif low > high:
            words = f"range {low}..{high} is upside down: '{high}' comes before '{low}'"
        else:
            values = dict.fromkeys(itertools.islice(identifiers(low, high), MOST_MEMBERS + 1))
            if len(values) <= MOST_MEMBERS:
                return Listed(values)  # type: ignore[arg-type]
            words = f"range {low}..{high} has more than {MOST_MEMBERS} members, expected less"
        self._problems.add(place, words)
        return _Anything()

    def _members(self, members: Members) -> Extent:
        values: dict[Value, None] = {}
        for term in members.terms:
            found: list[Variable | Arithmetic] = [*variables(term), *arithmetics((term,))]
            if found:
                self._problems.add(
                    found[0].place,
                    f"found {found[0]} in a set, expected numbers, names and records of them",
                )
                return _Anything()
            values[value_of(term)] = None
        return Listed(values)

    def _records(self, records: Records) -> Extent:
        problems, known = self._problems, True
        for sort in records.sorts:
            if sort.name not in self.sorts:
                _unknown(sort, self.sorts, self._text, problems)
                known = False
            elif isinstance(self.sorts[sort.name].extent, _Anything):
                known = False
        named = [each for each in records.variables if each is not None]
        for index, variable in enumerate(named):
            if variable in named[:index]:
                problems.add(
                    variable.place, f"{variable} occurs twice in a record; expected two variables"
                )
                known = False
        if not known:
            return _Anything()
        parts = tuple(self.sorts[sort.name] for sort in records.sorts)
        if records.condition is None:
            return Recorded(records.functor, parts, None)
        indices = {
            variable: index
            for index, variable in enumerate(records.variables)
            if variable is not None
        }
        for sign, variable in _compared(records.condition):
            if variable not in indices:
                problems.add(
                    variable.place,
                    f"{variable} is no variable of this record; expected "
                    f" one of {', '.join(map(str, indices)) or 'none'}",
                )
                return _Anything()
            if sign not in ("=", "!=") and parts[indices[variable]].forms:
                problems.add(
                    variable.place,
                    f"'{sign}' compares {variable}, whose sort "
                    f"'#{parts[indices[variable]].name}' has records; expected numbers or names",
                )
                return _Anything()
        condition = _condition(records.condition, indices)
        return Recorded(records.functor, parts, condition)

    def _concatenation(self, concatenation: Concatenation) -> Extent:
        pieces: list[Extent] = []
        size = 1
        for piece in concatenation.pieces:
            extent = self._extent(piece)
            if isinstance(extent, _Anything):
                return extent
            if extent.forms:
                what = f"sort '#{piece.name}'" if isinstance(piece, Named) else "this piece"
                self._problems.add(
                    piece.place, f"{what} has records; expected a basic sort in a concatenation"
                )
                return _Anything()
            pieces.append(extent)
            size *= extent.size
        if size > MOST_MEMBERS:
            self._problems.add(
                concatenation.place,
                f"concatenation has {size} members, expected at most {MOST_MEMBERS}",
            )
            return _Anything()
        values: dict[Value, None] = {}
        for parts in itertools.product(*pieces):
            joined = "".join(map(str, parts))
            if _IDENTIFIER.fullmatch(joined):
                values[joined] = None
            elif _NUMBER.fullmatch(joined) and int(joined) <= self._text.largest:
                values[int(joined)] = None
            else:
                self._problems.add(
                    concatenation.place,
                    f"concatenation makes '{joined}', expected names, or numbers of at most "
                    f"{self._text.largest}",
                )
                return _Anything()
        return Listed(values)


def _used(expression: Expression) -> list[Named]:
    """The sorts that a definition is made of."""
    match expression:
        case Named():
            return [expression]
        case Records():
            return list(expression.sorts)
        case Concatenation():
            return [each for each in expression.pieces if isinstance(each, Named)]
        case Combined():
            return [each for part in expression.parts for each in _used(part)]
    return []


def _compared(condition: Related) -> Iterator[tuple[str, Variable]]:
    for part in condition.parts:
        if isinstance(part, Related):
            yield from _compared(part)
        else:
            yield condition.operator, part


def _condition(
    condition: Related, indices: dict[Variable, int]
) -> Callable[[tuple[Value, ...]], bool]:
    inner = [_condition(part, indices) for part in condition.parts if isinstance(part, Related)]
    if condition.operator == "and":
        return lambda values: inner[0](values) and inner[1](values)
    if condition.operator == "or":
        return lambda values: inner[0](values) or inner[1](values)
    if condition.operator == "not":
        return lambda values: not inner[0](values)
    left, right = (indices[part] for part in condition.parts if isinstance(part, Variable))
    compare, ordered = _COMPARE[condition.operator], condition.operator not in ("=", "!=")

    def holds(values: tuple[Value, ...]) -> bool:
        one, other = values[left], values[right]
        if ordered:  # numbers come before names, as in clingo
            return compare((isinstance(one, str), one), (isinstance(other, str), other))
        return compare(one, other)

    return holds
