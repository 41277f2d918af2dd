"""What sorts hold. Members are plain values: numbers, names, and tuples for records.

A sort is not written out unless it must be: a record of two sorts of a thousand members has a
million, and neither checking a term nor most guards ask for them.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from ros_scenesense.knowledge.numbers import Interval
from ros_scenesense.knowledge.terms import Constant, Number, Record, Term

Value = int | str | tuple  # type: ignore[type-arg]
"""A number, an identifier, or a record as (functor, argument, ...)."""

MOST_MEMBERS = 1_000_000
"""A sort that has to be written out may have so many members."""

_MOST_COMPARED = 20_000
_LETTERS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz"  # in their order


class Extent(ABC):
    """A set of values."""

    @property
    @abstractmethod
    def size(self) -> int:
        """At most so many members, without looking at them."""

    @abstractmethod
    def __contains__(self, value: object) -> bool:
        """Whether the value is a member."""

    @abstractmethod
    def __iter__(self) -> Iterator[Value]:
        """The members, each perhaps several times."""

    @property
    def interval(self) -> Interval | None:
        """Bounds of the numbers in it; None if it surely has none."""
        return None

    def column(self, functor: str, arity: int, index: int) -> Extent | None:
        """What holds an argument of all records of a form in it; None if it has no such record."""
        del functor, arity, index
        return None

    @property
    def forms(self) -> frozenset[tuple[str, int]]:
        """Functor and number of arguments of the records that it may have."""
        return frozenset()


@dataclass(frozen=True, eq=False)
class Numbers(Extent):
    """Numbers from `low` to `high`."""

    low: int
    high: int

    @property
    def size(self) -> int:
        """As in `Extent`."""
        return self.high - self.low + 1

    def __contains__(self, value: object) -> bool:
        return isinstance(value, int) and self.low <= value <= self.high

    def __iter__(self) -> Iterator[Value]:
        return iter(range(self.low, self.high + 1))

    @property
    def interval(self) -> Interval | None:
        """As in `Extent`."""
        return self.low, self.high


@dataclass(frozen=True, eq=False)
class Listed(Extent):
    """Values one by one."""

    values: Mapping[Value, None]

    @property
    def size(self) -> int:
        """As in `Extent`."""
        return len(self.values)

    def __contains__(self, value: object) -> bool:
        return value in self.values

    def __iter__(self) -> Iterator[Value]:
        return iter(self.values)

    @cached_property
    def interval(self) -> Interval | None:
        """As in `Extent`."""
        numbers = [each for each in self.values if isinstance(each, int)]
        return (min(numbers), max(numbers)) if numbers else None

    def column(self, functor: str, arity: int, index: int) -> Extent | None:
        """As in `Extent`."""
        found = {
            each[index + 1]: None
            for each in self.values
            if isinstance(each, tuple) and each[0] == functor and len(each) == arity + 1
        }
        return Listed(found) if found else None

    @cached_property
    def forms(self) -> frozenset[tuple[str, int]]:
        """As in `Extent`."""
        return frozenset(
            (each[0], len(each) - 1) for each in self.values if isinstance(each, tuple)
        )


@dataclass(frozen=True, eq=False)
class Recorded(Extent):
    """Records of members of sorts; all of them, or those that a condition holds for."""

    functor: str
    parts: tuple[Sort, ...]
    condition: Callable[[tuple[Value, ...]], bool] | None

    @property
    def size(self) -> int:
        """As in `Extent`."""
        product = 1
        for part in self.parts:
            product *= part.size
        return product

    def __contains__(self, value: object) -> bool:
        if not isinstance(value, tuple) or value[0] != self.functor:
            return False
        arguments = value[1:]
        if len(arguments) != len(self.parts):
            return False
        if not all(each in part for each, part in zip(arguments, self.parts, strict=True)):
            return False
        return self.condition is None or self.condition(arguments)

    def __iter__(self) -> Iterator[Value]:
        for arguments in itertools.product(*self.parts):
            if self.condition is None or self.condition(arguments):
                yield (self.functor, *arguments)

    def column(self, functor: str, arity: int, index: int) -> Extent | None:
        """As in `Extent`."""
        if (functor, arity) != (self.functor, len(self.parts)):
            return None
        return self.parts[index]

    @property
    def forms(self) -> frozenset[tuple[str, int]]:
        """As in `Extent`."""
        return frozenset([(self.functor, len(self.parts))])


@dataclass(frozen=True, eq=False)
class Union(Extent):
    """All members of some sets."""

    parts: tuple[Extent, ...]

    @property
    def size(self) -> int:
        """As in `Extent`."""
        return sum(part.size for part in self.parts)

    def __contains__(self, value: object) -> bool:
        return any(value in part for part in self.parts)

    def __iter__(self) -> Iterator[Value]:
        return itertools.chain(*self.parts)

    @property
    def interval(self) -> Interval | None:
        """As in `Extent`."""
        known = [part.interval for part in self.parts if part.interval is not None]
        if not known:
            return None
        return min(low for low, _ in known), max(high for _, high in known)

    def column(self, functor: str, arity: int, index: int) -> Extent | None:
        """As in `Extent`."""
        found = [each.column(functor, arity, index) for each in self.parts]
        known = tuple(each for each in found if each is not None)
        return known[0] if len(known) == 1 else Union(known) if known else None

    @property
    def forms(self) -> frozenset[tuple[str, int]]:
        """As in `Extent`."""
        return frozenset().union(*(part.forms for part in self.parts))


@dataclass(frozen=True, eq=False)
class Filtered(Extent):
    """The members of one set that are (or are not) in another."""

    one: Extent
    other: Extent
    inside: bool

    @property
    def size(self) -> int:
        """As in `Extent`."""
        return self.one.size

    def __contains__(self, value: object) -> bool:
        return value in self.one and (value in self.other) == self.inside

    def __iter__(self) -> Iterator[Value]:
        return (each for each in self.one if (each in self.other) == self.inside)

    @property
    def interval(self) -> Interval | None:
        """As in `Extent`."""
        return self.one.interval

    def column(self, functor: str, arity: int, index: int) -> Extent | None:
        """As in `Extent`."""
        return self.one.column(functor, arity, index)

    @property
    def forms(self) -> frozenset[tuple[str, int]]:
        """As in `Extent`."""
        return self.one.forms


@dataclass(eq=False)
class Sort(Extent):
    """A set that has a name."""

    name: str
    extent: Extent = field(default_factory=lambda: Listed({}))
    _columns: dict[tuple[str, int, int], Extent | None] = field(default_factory=dict, repr=False)

    @property
    def size(self) -> int:
        """As in `Extent`."""
        return self.extent.size

    def __contains__(self, value: object) -> bool:
        return value in self.extent

    def __iter__(self) -> Iterator[Value]:
        return iter(self.extent)

    @property
    def interval(self) -> Interval | None:
        """As in `Extent`."""
        return self.extent.interval

    def column(self, functor: str, arity: int, index: int) -> Extent | None:
        """As in `Extent`."""
        asked = functor, arity, index
        if asked not in self._columns:
            self._columns[asked] = self.extent.column(functor, arity, index)
        return self._columns[asked]

    @cached_property
    def forms(self) -> frozenset[tuple[str, int]]:
        """As in `Extent`."""
        return self.extent.forms

    @property
    def numbers(self) -> Numbers | None:
        """The range that it is, if it is one."""
        extent = self.extent
        while isinstance(extent, Sort):
            extent = extent.extent
        return extent if isinstance(extent, Numbers) else None

    def plain_records(self, functor: str, arity: int) -> Recorded | None:
        """The definition of all its records of a form, if there is one, without condition."""
        found = list(_definitions(self.extent, functor, arity))
        if len(found) == 1 and isinstance(found[0], Recorded) and found[0].condition is None:
            return found[0]
        return None


class Covering:
    """Whether all members of a set are in another; remembers the answers."""

    def __init__(self) -> None:
        self._known: dict[tuple[Extent, Extent], bool] = {}

    def __call__(self, wide: Extent, narrow: Extent) -> bool:
        """True only if `narrow` is surely within `wide`."""
        key = wide, narrow
        if key not in self._known:
            self._known[key] = self._covers(wide, narrow)
        return self._known[key]

    def _covers(self, wide: Extent, narrow: Extent) -> bool:
        if wide is narrow:
            return True
        if isinstance(narrow, Sort):
            return self(wide, narrow.extent) or (
                isinstance(wide, Sort) and self(wide.extent, narrow)
            )
        if isinstance(wide, Sort):
            return self(wide.extent, narrow)
        if isinstance(narrow, Union):
            return all(self(wide, part) for part in narrow.parts)
        if isinstance(wide, Union) and any(self(part, narrow) for part in wide.parts):
            return True
        if isinstance(narrow, Filtered) and self(wide, narrow.one):
            return True
        if isinstance(narrow, Recorded) and isinstance(wide, Recorded) and wide.condition is None:
            return wide.functor == narrow.functor and (
                len(wide.parts) == len(narrow.parts) and all(map(self, wide.parts, narrow.parts))
            )
        if isinstance(narrow, Numbers) and isinstance(wide, Numbers):
            return wide.low <= narrow.low and narrow.high <= wide.high
        return narrow.size <= _MOST_COMPARED and all(each in wide for each in narrow)


def identifiers(low: str, high: str) -> Iterator[str]:
    """The identifiers from one to another, in lexicographic order, no shorter and no longer."""

    def grow(prefix: str) -> Iterator[str]:
        if prefix and low <= prefix <= high and len(low) <= len(prefix):
            yield prefix
        if len(prefix) < len(high):
            for letter in _LETTERS if prefix else _LETTERS[-26:]:
                longer = prefix + letter
                # What begins like this comes between `longer` and its last continuation.
                if longer <= high and longer + "z" * (len(high) - len(longer)) >= low:
                    yield from grow(longer)

    return grow("")


def value_of(term: Term) -> Value:
    """The value of a term without variables and arithmetic."""
    match term:
        case Number(value):
            return value
        case Constant(name):
            return name
        case Record(functor, arguments):
            return (functor, *map(value_of, arguments))
    raise ValueError(f"{term} has no value")


def value_text(value: Value) -> str:
    """A value as text, as clingo writes it."""
    if isinstance(value, tuple):
        return f"{value[0]}({','.join(map(value_text, value[1:]))})"
    return str(value)


def _definitions(extent: Extent, functor: str, arity: int) -> Iterator[Extent]:
    if isinstance(extent, Sort):
        yield from _definitions(extent.extent, functor, arity)
    elif isinstance(extent, Union):
        for part in extent.parts:
            yield from _definitions(part, functor, arity)
    elif (functor, arity) in extent.forms:
        yield extent
