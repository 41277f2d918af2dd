"""What keeps the instances of a rule well-sorted, and what of that need not be said.

An instance exists only where every atom in it is well-sorted. Conditions that say so go into the
body or, where they are about the variables of an element of an aggregate or a choice, into the
element. What follows from positive conditions is left out: whatever is derived is well-sorted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from ros_scenesense.knowledge.literals import (
    Belief,
    Comparison,
    Literal,
    Membership,
    variables_of,
)
from ros_scenesense.knowledge.sparc.declarations import Signature
from ros_scenesense.knowledge.sparc.sorts import Covering, Extent, Sort
from ros_scenesense.knowledge.sparc.statements import (
    Condition,
    Element,
    Rule,
    arithmetics,
)
from ros_scenesense.knowledge.sparc.walking import (
    beliefs,
    computed_terms,
    direct_variables,
    global_variables,
    literals_of,
    memberships_of,
    projected_variables,
)
from ros_scenesense.knowledge.terms import Arithmetic, Record, Term, Variable, variables


class Guard(NamedTuple):
    """The demand that a term belongs to a sort."""

    sort: Sort
    term: Term


@dataclass(frozen=True, slots=True)
class Guards:
    """The guards of a rule: of its body, and of each element in the order of `Rule.groups`."""

    body: tuple[Guard, ...]
    elements: tuple[tuple[Guard, ...], ...]


def demands(rule: Rule, signature: Signature) -> Iterator[Guard]:
    """The sort of each argument in a rule, with or without variables; wherever it stands."""
    for literal, _ in literals_of(rule):
        yield from _arguments(literal, signature)
    for member in memberships_of(rule):
        if not member.negated:
            yield Guard(signature.sorts[member.sort], member.term)
    for variable in _only_computed(rule):
        yield Guard(signature.nat, variable)


def columns(guard: Guard) -> Iterator[tuple[Variable, Extent]]:
    """The variables of its term outside arithmetic, each with what it can be."""
    yield from _columns(guard.sort, guard.term)


def _columns(extent: Extent, term: Term) -> Iterator[tuple[Variable, Extent]]:
    if isinstance(term, Variable):
        yield term, extent
    elif isinstance(term, Record):
        for index, argument in enumerate(term.arguments):
            column = extent.column(term.functor, len(term.arguments), index)
            if column is not None:
                yield from _columns(column, argument)


class Guarding:
    """Finds the guards of the rules of a program.

    Args:
        signature: Sorts and predicates.
    """

    def __init__(self, signature: Signature) -> None:
        self._signature = signature
        self._covers = Covering()

    def guards(self, rule: Rule) -> Guards:
        """The guards that have to be said."""
        outer = global_variables(rule)
        projected = projected_variables(rule)
        asked: dict[Guard, None] = {}
        for literal in rule.heads:
            self._ask(literal, asked)
        for literal, positive in beliefs(rule.conditions):
            if not positive:
                self._ask(literal, asked)
        numbers = [Guard(self._signature.nat, each) for each in _only_computed(rule)]
        inner: list[dict[Guard, None]] = []
        for group in rule.groups:
            for element in group.elements:
                own: dict[Guard, None] = {}
                if element.literal is not None:
                    self._ask(element.literal, own)
                for literal, positive in beliefs(element.conditions):
                    if not positive or any(True for each in _shared(literal, outer)):
                        self._ask(literal, own)
                local = _local(element, outer)
                asked.update((each, None) for each in own if local.isdisjoint(variables(each.term)))
                kept = {each: None for each in own if not local.isdisjoint(variables(each.term))}
                kept.update((each, None) for each in numbers if each.term in local)
                inner.append(kept)
        asked.update((each, None) for each in numbers if each.term in outer)
        given = self._given(rule.conditions)
        body = self._needed(asked, given, projected)
        for guard in body:
            given.setdefault(guard.term, []).append(guard.sort)
        elements = [element for group in rule.groups for element in group.elements]
        return Guards(
            body,
            tuple(
                self._needed(own, self._given(element.conditions, given), projected)
                for own, element in zip(inner, elements, strict=True)
            ),
        )

    def _ask(self, literal: Literal, asked: dict[Guard, None]) -> None:
        for guard in _arguments(literal, self._signature):
            if _varies(guard.term):
                asked.update((each, None) for each in _parts(guard))

    def _given(
        self, conditions: Iterable[Condition], more: dict[Term, list[Extent]] | None = None
    ) -> dict[Term, list[Extent]]:
        """What positive conditions say of terms."""
        given: dict[Term, list[Extent]] = {} if more is None else {**more}
        for condition in conditions:
            match condition:
                case Belief(literal, False):
                    for guard in _arguments(literal, self._signature):
                        _give(guard.sort, guard.term, given)
                case Membership(sort, term, False):
                    _give(self._signature.sorts[sort], term, given)
                case Belief() | Membership() | Comparison():
                    pass
        return given

    def _needed(
        self,
        asked: Iterable[Guard],
        given: dict[Term, list[Extent]],
        projected: frozenset[Variable],
    ) -> tuple[Guard, ...]:
        found: dict[Term, list[Guard]] = {}
        for guard in asked:
            if projected and not projected.isdisjoint(variables(guard.term)):
                continue
            if any(self._covers(guard.sort, each) for each in given.get(guard.term, ())):
                continue
            others = found.setdefault(guard.term, [])
            if not any(self._covers(guard.sort, each.sort) for each in others):
                others[:] = [each for each in others if not self._covers(each.sort, guard.sort)]
                others.append(guard)
        return tuple(guard for group in found.values() for guard in group)


def _only_computed(rule: Rule) -> list[Variable]:
    """The variables of atoms that stand in arithmetic alone: they range over `#nat`."""
    if not computed_terms(rule) and not memberships_of(rule):
        return []
    terms = [term for literal, _ in literals_of(rule) for term in literal.atom.arguments]
    terms += [each.term for each in memberships_of(rule)]
    computed = [each for sum_ in arithmetics(terms) for each in variables(sum_)]
    direct = {each for term in terms for each in direct_variables(term)}
    return [each for each in dict.fromkeys(computed) if each not in direct]


def _arguments(literal: Literal, signature: Signature) -> Iterator[Guard]:
    atom = literal.atom
    for sort, term in zip(signature.predicates[atom.name], atom.arguments, strict=True):
        yield Guard(sort, term)


def _varies(term: Term) -> bool:
    return isinstance(term, Variable) or next(variables(term), None) is not None


def _parts(guard: Guard) -> Iterator[Guard]:
    """The same demand as demands on the arguments of a record, where that says as much."""
    term = guard.term
    if isinstance(term, Record):
        plain = guard.sort.plain_records(term.functor, len(term.arguments))
        if plain is not None:
            for sort, argument in zip(plain.parts, term.arguments, strict=True):
                if _varies(argument):
                    yield from _parts(Guard(sort, argument))
            return
    yield guard


def _give(extent: Extent, term: Term, given: dict[Term, list[Extent]]) -> None:
    given.setdefault(term, []).append(extent)
    if isinstance(term, Record):
        for index, argument in enumerate(term.arguments):
            if not isinstance(argument, Arithmetic):
                column = extent.column(term.functor, len(term.arguments), index)
                if column is not None:
                    _give(column, argument, given)


def _shared(literal: Literal, outer: frozenset[Variable]) -> Iterator[Variable]:
    return (each for each in variables_of(literal) if each in outer)


def _local(element: Element, outer: frozenset[Variable]) -> frozenset[Variable]:
    found = {each for term in element.terms for each in variables(term)}
    if element.literal is not None:
        found.update(variables_of(element.literal))
    for condition in element.conditions:
        found.update(variables_of(condition))
    return frozenset(found - outer)
