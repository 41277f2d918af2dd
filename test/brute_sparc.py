"""The answer sets of SPARC programs, straight from the definitions.

Nothing of guards and translation is used, and no solver: every assignment of values to variables
makes an instance, if all its atoms are well-sorted; then reducts, minimal models, the smallest sets
of CR rules, the cheapest answer sets. For small programs only; aggregates and the conditions of
choices may only speak of predicates that are given by facts.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from ros_scenesense.knowledge.literals import Belief, Comparison, Literal, Membership, variables_of
from ros_scenesense.knowledge.sparc.statements import Aggregate, Choice, Element, Form, Rule
from ros_scenesense.knowledge.terms import Arithmetic, Constant, Number, Record, Variable, variables

COMPARE = {
    "=": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}
CALCULATE = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: int(a / b) if b else None,
}


class IllSorted(Exception):  # noqa: N818
    """This assignment makes no instance."""


@dataclass(frozen=True)
class Ground:
    """A ground rule. Bits say which literals: heads, needed, absent."""

    form: Form
    head: int
    choice: tuple[int, int, int] | None  # literals, least and most of them
    needed: int
    absent: int
    cost: int = 0


class BruteForce:
    """Answer sets of rules.

    Args:
        rules: As they were read.
        sorts: The members of each sort.
        predicates: The names of the sorts of the arguments of each predicate.
        largest: The largest number.
    """

    def __init__(self, rules, sorts, predicates, largest):
        self.sorts = sorts
        self.predicates = predicates
        self.universe = sorted(
            {each for members in sorts.values() for each in members} | set(range(largest + 1)),
            key=str,
        )
        self.bits: dict[str, int] = {}
        self.facts: set[str] = set()
        rules = [each for each in rules if isinstance(each, Rule)]
        for rule in rules:
            if isinstance(rule.head, tuple) and len(rule.head) == 1 and not rule.body:
                self.facts.update(
                    self.said(rule.head[0], binding) for binding in self.bindings(rule)
                )
        self.rules = [
            instance
            for rule in rules
            for binding in self.bindings(rule)
            for instance in self.instance(rule, binding)
        ]

    def answer_sets(self) -> set[frozenset[str]]:
        regular = [rule for rule in self.rules if rule.form is Form.RULE]
        restoring = [rule for rule in self.rules if rule.form is Form.CR]
        for size in range(len(restoring) + 1):
            found = {
                model
                for chosen in itertools.combinations(restoring, size)
                for model in self.models([*regular, *chosen])
            }
            if found:
                weak = [rule for rule in self.rules if rule.form is Form.WEAK]
                costs = {
                    model: sum(rule.cost for rule in weak if applies(rule, model))
                    for model in found
                }
                best = min(costs.values())
                return {self.literals(each) for each, cost in costs.items() if cost == best}
        return set()

    def models(self, rules: list[Ground]) -> Iterator[int]:
        heads = {bit for rule in rules for bit in split(rule.head)}
        heads |= {bit for rule in rules if rule.choice for bit in split(rule.choice[0])}
        certain = 0
        for rule in rules:
            unconditional = not rule.needed and not rule.absent and not rule.choice
            if unconditional and len(list(split(rule.head))) == 1:
                certain |= rule.head
        opposed = [
            self.bits[said] | self.bits[said[1:]]
            for said in self.bits
            if said.startswith("-") and said[1:] in self.bits
        ]
        free = sorted(heads - set(split(certain)))
        disjunctive = any(len(list(split(rule.head))) > 1 for rule in rules)
        for size in range(len(free) + 1):
            for chosen in itertools.combinations(free, size):
                candidate = certain | sum(chosen)
                if any(pair & ~candidate == 0 for pair in opposed):
                    continue
                if self.is_answer(candidate, rules, disjunctive):
                    yield candidate

    def is_answer(self, candidate: int, rules: list[Ground], disjunctive: bool) -> bool:
        reduct = []
        for rule in rules:
            if rule.absent & candidate:
                continue
            if rule.choice is None:
                reduct.append((rule.head, rule.needed))
                if not rule.needed & ~candidate and not rule.head & candidate:
                    return False
            else:
                literals, least, most = rule.choice
                made = list(split(literals & candidate))
                if not rule.needed & ~candidate and not least <= len(made) <= most:
                    return False
                reduct += [(bit, rule.needed) for bit in made]
        if not disjunctive:
            model, before = 0, None
            while model != before:
                before = model
                for head, needed in reduct:
                    if not needed & ~model:
                        model |= head
            return model == candidate
        # No smaller set is closed.
        inside = list(split(candidate))
        for size in range(len(inside)):
            for chosen in itertools.combinations(inside, size):
                smaller = sum(chosen)
                if all(needed & ~smaller or head & smaller for head, needed in reduct):
                    return False
        return True

    def literals(self, model: int) -> frozenset[str]:
        return frozenset(said for said, bit in self.bits.items() if bit & model)

    def bindings(self, rule: Rule) -> Iterator[dict]:
        """All assignments that make every atom well-sorted."""
        names = sorted(self.outer(rule), key=str)
        for values in itertools.product(self.universe, repeat=len(names)):
            binding = dict(zip(names, values, strict=True))
            try:
                self.sorted_atoms(rule, binding)
            except IllSorted:
                continue
            yield binding

    def outer(self, rule: Rule) -> set[Variable]:
        found = {each for literal in rule.heads for each in variables_of(literal)}
        for condition in rule.conditions:
            local = isinstance(condition, Belief) and condition.negated
            found |= {
                each
                for each in variables_of(condition)
                if not (local and each.name.startswith("_"))
            }
        for term in rule.bounds:
            found |= set(variables(term))
        return found

    def sorted_atoms(self, rule: Rule, binding: dict) -> None:
        literals = list(rule.heads)
        for condition in rule.conditions:
            if isinstance(condition, Belief):
                literals.append(condition.literal)
        for group in rule.groups:
            for element in group.elements:
                literals += [element.literal] if element.literal else []
                literals += [
                    each.literal for each in element.conditions if isinstance(each, Belief)
                ]
        for literal in literals:
            for term, sort in zip(
                literal.atom.arguments, self.predicates[literal.atom.name], strict=True
            ):
                known = all(each in binding for each in variables(term))
                if known and self.value(term, binding) not in self.sorts[sort]:
                    raise IllSorted

    def instance(self, rule: Rule, binding: dict) -> Iterator[Ground]:
        needed = absent = 0
        try:
            for condition in rule.body:
                if isinstance(condition, Aggregate):
                    if not self.aggregate(condition, binding):
                        return
                elif isinstance(condition, Belief):
                    if not condition.negated:
                        needed |= self.bit(self.said(condition.literal, binding))
                    for said in self.instances(condition, binding) if condition.negated else ():
                        absent |= self.bit(said)
                elif not self.test(condition, binding):
                    return
            heads = [self.bit(self.said(each, binding)) for each in rule.heads]
            choice = None
            if isinstance(rule.head, Choice):
                made = {
                    self.bit(self.said(element.literal, {**binding, **own}))
                    for element in rule.head.elements
                    for own in self.matching(element, binding)
                }
                least = self.value(rule.head.left.term, binding) if rule.head.left else 0
                most = self.value(rule.head.right.term, binding) if rule.head.right else 99
                choice = sum(made), least, most
        except IllSorted:
            return
        cost = self.value(rule.weight, binding) if rule.form is Form.WEAK else 0
        yield Ground(rule.form, joined(heads), choice, needed, absent, cost)

    def instances(self, belief: Belief, binding: dict) -> Iterator[str]:
        local = [each for each in variables_of(belief) if each not in binding]
        for values in itertools.product(self.universe, repeat=len(local)):
            both = {**binding, **dict(zip(local, values, strict=True))}
            try:
                yield self.said(belief.literal, both)
            except IllSorted:
                continue

    def aggregate(self, aggregate: Aggregate, binding: dict) -> bool:
        tuples = {
            tuple(self.value(term, {**binding, **own}) for term in element.terms)
            for element in aggregate.elements
            for own in self.matching(element, binding)
        }
        number = len(tuples) if aggregate.function == "#count" else sum(each[0] for each in tuples)
        if aggregate.left and not COMPARE[aggregate.left.operator](
            self.value(aggregate.left.term, binding), number
        ):
            return False
        return not aggregate.right or COMPARE[aggregate.right.operator](
            number, self.value(aggregate.right.term, binding)
        )

    def matching(self, element: Element, binding: dict) -> Iterator[dict]:
        """The values of local variables for which the conditions hold, all atoms well-sorted."""
        local = {each for term in element.terms for each in variables(term)}
        if element.literal:
            local |= set(variables_of(element.literal))
        for condition in element.conditions:
            local |= set(variables_of(condition))
        names = sorted(local - set(binding), key=str)
        for values in itertools.product(self.universe, repeat=len(names)):
            own = dict(zip(names, values, strict=True))
            both = {**binding, **own}
            try:
                if element.literal:
                    self.said(element.literal, both)
                holds = [
                    (self.said(each.literal, both) in self.facts) != each.negated
                    if isinstance(each, Belief)
                    else self.test(each, both)
                    for each in element.conditions
                ]
            except IllSorted:
                continue
            if all(holds):
                yield own

    def test(self, condition: Comparison | Membership, binding: dict) -> bool:
        if isinstance(condition, Membership):
            inside = self.value(condition.term, binding) in self.sorts[condition.sort]
            return inside != condition.negated
        left, right = self.value(condition.left, binding), self.value(condition.right, binding)
        if left is None or right is None:
            raise IllSorted
        return COMPARE[condition.operator](key(left), key(right))

    def said(self, literal: Literal, binding: dict) -> str:
        atom = literal.atom
        values = [self.value(term, binding) for term in atom.arguments]
        sorts = self.predicates[atom.name]
        if not all(value in self.sorts[sort] for value, sort in zip(values, sorts, strict=True)):
            raise IllSorted
        text = f"{atom.name}({','.join(map(str, values))})" if values else atom.name
        return text if literal.positive else f"-{text}"

    def bit(self, said: str) -> int:
        return self.bits.setdefault(said, 1 << len(self.bits))

    def value(self, term, binding: dict):
        match term:
            case Variable():
                return binding[term]
            case Number(value):
                return value
            case Constant(name):
                return name
            case Record(functor, arguments):
                inner = ",".join(str(self.value(each, binding)) for each in arguments)
                return f"{functor}({inner})"
            case Arithmetic(operator, left, right):
                one, other = self.value(left, binding), self.value(right, binding)
                if not isinstance(one, int) or not isinstance(other, int):
                    return None
                return CALCULATE[operator](one, other)


def applies(rule: Ground, model: int) -> bool:
    return not rule.needed & ~model and not rule.absent & model


def split(bits: int) -> Iterator[int]:
    while bits:
        lowest = bits & -bits
        yield lowest
        bits ^= lowest


def joined(bits: Iterable[int]) -> int:
    result = 0
    for bit in bits:
        result |= bit
    return result


def key(value: int | str) -> tuple[bool, int | str]:
    """Numbers come before names."""
    return isinstance(value, str), value
