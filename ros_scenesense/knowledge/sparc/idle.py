"""Rules that can never apply: no instance of theirs is well-sorted.

Variables that no argument, comparison or sum connects are looked at apart; where the connected ones
have too many values together, nothing is said.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from ros_scenesense.knowledge.literals import Comparison, terms_of
from ros_scenesense.knowledge.sparc.guards import Guard, columns, demands
from ros_scenesense.knowledge.sparc.language import Program
from ros_scenesense.knowledge.sparc.sorts import Extent, Value
from ros_scenesense.knowledge.sparc.statements import Rule
from ros_scenesense.knowledge.sparc.walking import global_variables
from ros_scenesense.knowledge.terms import (
    Arithmetic,
    Constant,
    Number,
    Record,
    Term,
    Variable,
    variables,
)

_MOST_TRIED = 50_000


@dataclass(frozen=True)
class _Test:
    """A guard or a comparison, with its variables."""

    what: Guard | Comparison
    variables: frozenset[Variable]


def idle_rules(program: Program) -> Iterator[str]:
    """A line for each rule that can never apply, as `source:line:column: ...`."""
    for rule in program.text.rules:
        if isinstance(rule, Rule):
            reason = _reason(rule, program)
            if reason:
                yield f"{rule.place}: this rule can never apply: {reason}"


def _reason(rule: Rule, program: Program) -> str:
    outer = global_variables(rule)
    tests = []
    for guard in demands(rule, program.signature):
        found = frozenset(variables(guard.term))
        if found <= outer:
            tests.append(_Test(guard, found))
    for condition in rule.conditions:
        if isinstance(condition, Comparison):
            found = frozenset(each for term in terms_of(condition) for each in variables(term))
            tests.append(_Test(condition, found))
    for group in _connected(tests):
        if not _satisfiable(group):
            names = sorted({each.name for test in group for each in test.variables})
            about = f" for {', '.join(names)}" if names else ""
            return f"no value{about} fits {_listed(group)}"
    return ""


def _listed(tests: Sequence[_Test]) -> str:
    words = []
    for test in tests:
        if isinstance(test.what, Guard):
            words.append(f"#{test.what.sort.name}({test.what.term})")
        else:
            words.append(str(test.what))
    return ", ".join(dict.fromkeys(words))


def _connected(tests: Iterable[_Test]) -> list[list[_Test]]:
    groups: list[tuple[set[Variable], list[_Test]]] = []
    for test in tests:
        joined = (set(test.variables), [test])
        apart = []
        for group in groups:
            if group[0].isdisjoint(joined[0]):
                apart.append(group)
            else:
                joined = (joined[0] | group[0], group[1] + joined[1])
        groups = [*apart, joined]
    return [group for _, group in groups]


def _satisfiable(tests: Sequence[_Test]) -> bool:
    """Whether some values fit; also true if there are too many to try."""
    domains: dict[Variable, Extent] = {}
    for test in tests:
        if isinstance(test.what, Guard):
            for variable, extent in columns(test.what):
                if variable not in domains or extent.size < domains[variable].size:
                    domains[variable] = extent
            if _shapeless(test.what):
                return False
    names = list(domains)
    if not all(variable in domains for test in tests for variable in test.variables):
        return True
    product = 1
    for extent in domains.values():
        product *= max(1, extent.size)
    if product > _MOST_TRIED:
        return True
    return any(
        all(_holds(test.what, dict(zip(names, values, strict=True))) for test in tests)
        for values in itertools.product(*domains.values())
    )


def _shapeless(guard: Guard) -> bool:
    """Whether the term is a record of a form that the sort does not have."""
    term = guard.term
    return isinstance(term, Record) and (
        (term.functor, len(term.arguments)) not in guard.sort.forms
    )


def _holds(what: Guard | Comparison, values: dict[Variable, Value]) -> bool:
    if isinstance(what, Guard):
        value = _value(what.term, values)
        return value is not None and value in what.sort
    left, right = _value(what.left, values), _value(what.right, values)
    if left is None or right is None:
        return False
    if what.operator in ("=", "!="):
        return (left == right) == (what.operator == "=")
    if not isinstance(left, int) or not isinstance(right, int):
        return True  # names and records have an order too, which is left to the solver
    return {"<": left < right, "<=": left <= right, ">": left > right, ">=": left >= right}[
        what.operator
    ]


def _value(term: Term, values: dict[Variable, Value]) -> Value | None:
    """The value of a term, None where it has none."""
    match term:
        case Number(value):
            return value
        case Constant(name):
            return name
        case Variable():
            return values[term]
        case Record(functor, arguments):
            inner = [_value(each, values) for each in arguments]
            known = [each for each in inner if each is not None]
            return (functor, *known) if len(known) == len(inner) else None
        case Arithmetic():
            left, right = _value(term.left, values), _value(term.right, values)
            if not isinstance(left, int) or not isinstance(right, int):
                return None
            if term.operator == "/":
                return None if right == 0 else int(left / right)
            return {"+": left + right, "-": left - right, "*": left * right}[term.operator]
