"""What a rule is made of: its literals, tests, terms and variables, wherever they stand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import wraps
from typing import TypeVar

from ros_scenesense.knowledge.literals import (
    Belief,
    Comparison,
    Literal,
    Membership,
    terms_of,
    variables_of,
)
from ros_scenesense.knowledge.sparc.statements import (
    Condition,
    Element,
    Rule,
    arithmetics,
    is_anonymous,
)
from ros_scenesense.knowledge.terms import Arithmetic, Number, Record, Term, Variable, variables

Result = TypeVar("Result")


def once(function: Callable[[Rule], Result]) -> Callable[[Rule], Result]:
    """Computes something of a rule once, and remembers it with the rule: it is asked for often."""
    name = function.__name__

    @wraps(function)
    def remembered(rule: Rule) -> Result:
        known: dict[str, Result] = rule.__dict__
        if name not in known:
            known[name] = function(rule)
        return known[name]

    return remembered


@once
def global_variables(rule: Rule) -> frozenset[Variable]:
    """The variables whose values make an instance; all others are local to an element."""
    found = {each for literal in rule.heads for each in variables_of(literal)}
    for condition in rule.conditions:
        found.update(variables_of(condition))
    for term in (*rule.bounds, *rule.terms):
        found.update(variables(term))
    return frozenset(found)


@once
def literals_of(rule: Rule) -> tuple[tuple[Literal, bool], ...]:
    """All literals of a rule, and whether each is a condition without `not`."""
    found = [(literal, False) for literal in rule.heads]
    found += beliefs(rule.conditions)
    for group in rule.groups:
        for element in group.elements:
            if element.literal is not None:
                found.append((element.literal, False))
            found += beliefs(element.conditions)
    return tuple(found)


@once
def memberships_of(rule: Rule) -> tuple[Membership, ...]:
    """All tests of sorts."""
    elements = [element for group in rule.groups for element in group.elements]
    return tuple(
        condition
        for conditions in (rule.conditions, *(element.conditions for element in elements))
        for condition in conditions
        if isinstance(condition, Membership)
    )


@once
def projected_variables(rule: Rule) -> frozenset[Variable]:
    """The `_` of beliefs, except in arithmetic: clingo's own `_`, "no value at all" under `not`."""
    if not rule.groups and not any(map(is_anonymous, global_variables(rule))):
        return frozenset()
    elements = [element for group in rule.groups for element in group.elements]
    found: set[Variable] = set()
    for conditions in (rule.conditions, *(element.conditions for element in elements)):
        for condition in conditions:
            if isinstance(condition, Belief):
                found.update(each for each in variables_of(condition) if is_anonymous(each))
                for sum_ in arithmetics(condition.literal.atom.arguments):
                    found.difference_update(variables(sum_))
    return frozenset(found)


def direct_variables(term: Term) -> Iterator[Variable]:
    """The variables of a term that stand outside arithmetic."""
    match term:
        case Variable():
            yield term
        case Record():
            for argument in term.arguments:
                yield from direct_variables(argument)
        case _:
            return


def beliefs(conditions: Iterable[Condition]) -> Iterator[tuple[Literal, bool]]:
    """The literals of conditions, and whether each stands without `not`."""
    for condition in conditions:
        if isinstance(condition, Belief):
            yield condition.literal, not condition.negated


def comparisons_of(rule: Rule) -> Iterator[Comparison]:
    """All comparisons of a rule."""
    elements = [element for group in rule.groups for element in group.elements]
    for conditions in (rule.conditions, *(element.conditions for element in elements)):
        yield from (each for each in conditions if isinstance(each, Comparison))


def terms_in(rule: Rule) -> Iterator[Term]:
    """The outermost terms of a rule, but for those of tests and of elements of aggregates."""
    yield from rule.bounds
    yield from rule.terms
    for literal, _ in literals_of(rule):
        yield from literal.atom.arguments
    for comparison in comparisons_of(rule):
        yield from terms_of(comparison)


@once
def computed_terms(rule: Rule) -> list[Arithmetic]:
    """The outermost arithmetic of the terms in `terms_in`."""
    return arithmetics(terms_in(rule))


def occurrences(rule: Rule) -> Iterator[Variable]:
    """The variables outside elements, each at its first place; `_` of beliefs stands for itself."""
    projected = projected_variables(rule)
    found: dict[Variable, Variable] = {}
    parts: list[Iterable[Variable]] = [
        variables_of(each) for each in (*rule.heads, *rule.conditions)
    ]
    parts += [variables(term) for term in (*rule.bounds, *rule.terms)]
    for part in parts:
        for variable in part:
            if variable not in projected:
                found.setdefault(variable, variable)
    return iter(found.values())


def element_occurrences(element: Element) -> Iterator[Variable]:
    """The variables of the terms and conditions of an element."""
    found = [each for term in element.terms for each in variables(term)]
    for condition in element.conditions:
        found += variables_of(condition)
    return iter(dict.fromkeys(found))


def atomic_variables(element: Element) -> set[Variable]:
    """The variables of an element that some atom of it gives values."""
    found = set() if element.literal is None else set(variables_of(element.literal))
    for condition in element.conditions:
        negated = getattr(condition, "negated", False)
        if not isinstance(condition, Comparison) and not (
            negated and not hasattr(condition, "literal")
        ):
            found.update(variables_of(condition))
    return found


def evaluated(term: Term) -> int | None:
    """The number that arithmetic without variables is; None if it is none."""
    if isinstance(term, Number):
        return term.value
    if not isinstance(term, Arithmetic):
        return None
    left, right = evaluated(term.left), evaluated(term.right)
    if left is None or right is None:
        return None
    if term.operator == "/":
        return None if right == 0 else int(left / right)
    return {"+": left + right, "-": left - right, "*": left * right}[term.operator]
