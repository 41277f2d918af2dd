"""The sorted signature: sorts in a hierarchy, statics, three kinds of fluents, actions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property

from ros_scenesense.knowledge.terms import Number, Place, Symbol


class AttributeKind(StrEnum):
    """How the value of a domain attribute comes about.

    `STATIC`: never changes; a static that is not known stays unknown. `INERTIAL`: keeps its value
    until an action changes it. `DEFINED`: true if and only if a state constraint derives it (closed
    world). `ESTIMATED`: derived anew in every state, neither inertia nor closed world: where no
    axiom speaks, the fluent is unknown.
    """

    STATIC = "static"
    INERTIAL = "inertial"
    DEFINED = "defined"
    ESTIMATED = "estimated"


@dataclass(frozen=True)
class Sort:
    """A sort: its own members, or the range of its numbers; what its subsorts hold comes on top.

    Attributes:
        name: Its name, also the name of the predicate that says who belongs to it.
        supersorts: The sorts directly above it.
        members: Its own members.
        bounds: Lowest and highest number of a numeric sort.
        place: Where it was declared.
    """

    name: str
    supersorts: tuple[str, ...] = ()
    members: tuple[Symbol, ...] = ()
    bounds: tuple[int, int] | None = None
    place: Place | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Attribute:
    """A domain attribute, static or fluent: its name, its kind, the sorts of its arguments."""

    name: str
    kind: AttributeKind
    arguments: tuple[str, ...] = ()
    place: Place | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Action:
    """An action; an exogenous one happens without the robot, and only explains observations."""

    name: str
    arguments: tuple[str, ...] = ()
    exogenous: bool = False
    place: Place | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Signature:
    """All that statements may speak of; the three mappings by name share one name space."""

    sorts: Mapping[str, Sort]
    attributes: Mapping[str, Attribute]
    actions: Mapping[str, Action]

    def attributes_of(self, *kinds: AttributeKind) -> Iterator[Attribute]:
        """The attributes of these kinds, as declared."""
        return (each for each in self.attributes.values() if each.kind in kinds)

    def argument_sorts(self, name: str) -> tuple[str, ...]:
        """Sorts of the arguments of an attribute, an action, or a sort as a predicate.

        Raises:
            KeyError: If the name is not declared.
        """
        if name in self.sorts:
            return (name,)
        return (self.attributes.get(name) or self.actions[name]).arguments

    def is_subsort(self, lower: str, upper: str) -> bool:
        """Whether everything that belongs to `lower` belongs to `upper`."""
        return upper in self._above[lower]

    def family(self, sort: str) -> tuple[str, ...]:
        """The sort and all below it, as declared."""
        return tuple(name for name in self.sorts if sort in self._above[name])

    def members(self, sort: str) -> tuple[Symbol, ...]:
        """All members of a sort and of those below it, each once, numbers written out."""
        return tuple(dict.fromkeys(self._members(sort)))

    def contains(self, sort: str, symbol: Symbol) -> bool:
        """Whether the symbol belongs to the sort."""
        for name in self.family(sort):
            each = self.sorts[name]
            if symbol in each.members:
                return True
            if each.bounds is not None and isinstance(symbol, Number):
                low, high = each.bounds
                if low <= symbol.value <= high:
                    return True
        return False

    def with_members(self, sort: str, symbols: Iterable[Symbol]) -> Signature:
        """The same signature with more members of a sort, e.g. the objects of a scene.

        Raises:
            KeyError: If the sort is not declared.
        """
        old = self.sorts[sort]
        new = replace(old, members=tuple(dict.fromkeys((*old.members, *symbols))))
        return replace(self, sorts={**self.sorts, sort: new})

    def _members(self, sort: str) -> Iterator[Symbol]:
        for name in self.family(sort):
            each = self.sorts[name]
            yield from each.members
            if each.bounds is not None:
                low, high = each.bounds
                yield from map(Number, range(low, high + 1))

    @cached_property
    def _above(self) -> dict[str, frozenset[str]]:
        """Per sort, itself and everything above it; a recursive hierarchy does no harm here."""
        above: dict[str, frozenset[str]] = {}
        for name in self.sorts:
            found, fresh = {name}, [name]
            while fresh:
                supersorts = self.sorts[fresh.pop()].supersorts
                more = [each for each in supersorts if each in self.sorts and each not in found]
                found.update(more)
                fresh.extend(more)
            above[name] = frozenset(found)
        return above
