"""States, transitions and CR rules of an action-language domain, straight from their definitions.

Nothing of the translation is used, and no solver: ground rules, reducts, least models, and all
candidates one after the other. For small domains only.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from ros_scenesense.knowledge.axioms import (
    Axiom,
    CausalLaw,
    Default,
    ExecutabilityCondition,
    InitialDefault,
    StateConstraint,
)
from ros_scenesense.knowledge.description import History, SystemDescription
from ros_scenesense.knowledge.literals import Belief, Comparison, Literal, Membership, variables_of
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Arithmetic, Number, Term, Variable

Said = tuple[str, bool]
"""A ground literal: the text of its atom, and its sign."""

State = frozenset[Said]
Path = tuple[State, ...]
COMPARE = {
    "=": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}


@dataclass(frozen=True)
class Rule:
    """A ground rule: one head at most, what must and what must not be believed, as sets of bits."""

    head: int
    needed: int
    absent: int
    axiom: Axiom
    text: str


class BruteForce:
    """Sets of ground literals are sets of bits, one for each literal.

    Args:
        description: The domain.
        complete: Whether inertial fluents are true or false; otherwise they may be unknown.
    """

    def __init__(self, description: SystemDescription, complete: bool = True) -> None:
        self.complete = complete
        self.description = description
        self.signature = description.signature
        self._bits: dict[Said, int] = {}
        self.inertial = self._atoms(AttributeKind.INERTIAL)
        self.defined = self._atoms(AttributeKind.DEFINED)
        self.estimated = self._atoms(AttributeKind.ESTIMATED)
        self.facts = self._set((str(each.atom), each.positive) for each in description.facts)
        self.changeable = self._set(
            (atom, sign) for atom in self.inertial for sign in (True, False)
        )
        self._true = self._set((atom, True) for atom in self.inertial)
        rules = [rule for axiom in description.axioms for rule in self._ground(axiom)]
        self.constraints = [each for each in rules if isinstance(each.axiom, StateConstraint)]
        self.causal = [each for each in rules if isinstance(each.axiom, CausalLaw)]
        self.impossible = [each for each in rules if isinstance(each.axiom, ExecutabilityCondition)]
        self.defaults = [each for each in rules if isinstance(each.axiom, Default)]
        self.initial = [each for each in rules if isinstance(each.axiom, InitialDefault)]
        self.candidates = list(self._candidates())

    def paths(self, history: History, applied: frozenset[tuple[str, int]] = frozenset()) -> set:
        """All sequences of states that are models of the history, with these CR rules applied."""
        seen = [
            self._set(
                (str(each.fluent), not each.value)
                for each in history.observations
                if each.step == step
            )
            for step in range(history.last_step + 1)
        ]
        learned = [
            self._set(
                (str(each.fluent), each.value)
                for each in history.observations
                if each.step == step and str(each.fluent) in self.inertial and not self.complete
            )
            for step in range(history.last_step + 1)
        ]
        paths = [
            [state] for state in self._first(history, applied, learned[0]) if not state & seen[0]
        ]
        for step in range(history.last_step):
            actions = {str(each.action) for each in history.happened if each.step == step}
            actions |= {
                name.removeprefix("event(")[:-1]
                for name, when in applied
                if name.startswith("event(") and when == step
            }
            after = {
                state: [
                    later
                    for later in self._successors(
                        state, actions, step + 1, applied, learned[step + 1]
                    )
                    if not later & seen[step + 1]
                ]
                for state in {path[-1] for path in paths}
            }
            paths = [[*path, state] for path in paths for state in after[path[-1]]]
        return {tuple(map(self._literals, path)) for path in paths}

    def restored(self, history: History) -> set[tuple[frozenset[tuple[str, int]], Path]]:
        """The models with the smallest sets of applied CR rules, together with these sets."""
        steps = range(history.last_step + 1)
        instances = {(rule.text, step) for rule in self.defaults for step in steps}
        instances |= {(rule.text, 0) for rule in self.initial}
        for action in self.signature.actions.values():
            if action.exogenous:
                instances |= {
                    (f"event({atom})", step)
                    for atom in self._instances(action.name, action.arguments)
                    for step in steps[:-1]
                }
        for size in range(len(instances) + 1):
            found = {
                (frozenset(applied), path)
                for applied in itertools.combinations(sorted(instances), size)
                for path in self.paths(history, frozenset(applied))
            }
            if found:
                return found
        return set()

    def _first(self, history: History, applied: frozenset, learned: int) -> Iterator[int]:
        given = self._set((str(each.atom), each.positive) for each in history.initial) | learned
        initial = self._with_exceptions(self.initial, 0, applied)
        rules = [*self._lasting(0, applied), *initial]
        for candidate in self.candidates:
            if given & ~candidate:
                continue
            # The value of a fluent is free unless a default speaks of it.
            free = candidate & self.changeable if self.complete else 0
            for rule in self.initial:
                if self._applies(rule, candidate):
                    free &= ~(rule.head | self._opposite(rule.head))
            if self._closed(candidate, free | given, rules):
                yield candidate

    def _successors(
        self, state: int, actions: set[str], step: int, applied: frozenset, learned: int
    ) -> Iterator[int]:
        now = state | self._set((action, True) for action in actions)
        if any(self._applies(rule, now) for rule in self.impossible):
            return
        effects = learned & ~state & ~self._opposites(state)
        for rule in self.causal:
            if self._applies(rule, now):
                effects |= rule.head
        rules = self._lasting(step, applied)
        for candidate in self.candidates:
            if not effects & ~candidate:
                kept = state & self.changeable & ~self._opposites(candidate)
                if self._closed(candidate, effects | kept, rules):
                    yield candidate

    def _candidates(self) -> Iterator[int]:
        """All states: estimated fluents may be unknown, inertial ones only if so wished."""
        both = [
            [self._set([(atom, sign)]) for sign in (True, False)]
            for atom in (*self.inertial, *self.defined, *self.estimated)
        ]
        inertial, known = len(self.inertial), len(self.inertial) + len(self.defined)
        choices = [
            [*each, 0] if index >= known or (index < inertial and not self.complete) else each
            for index, each in enumerate(both)
        ]
        for parts in itertools.product(*choices):
            yield sum(parts)

    def _closed(self, candidate: int, given: int, rules: Sequence[Rule]) -> bool:
        """Whether the candidate is the least model of the reduct of rules and given literals."""
        believed = candidate | self.facts
        model = given | self.facts
        for atom in self.defined:
            if not self._bits[atom, True] & candidate:
                model |= self._bits[atom, False]
        active = [rule for rule in rules if not rule.absent & believed]
        before = None
        while before != model:
            before = model
            for rule in active:
                if not rule.needed & ~model:
                    model |= rule.head
            if model & ~believed:
                return False
        return model == believed

    def _lasting(self, step: int, applied: frozenset) -> list[Rule]:
        return [*self.constraints, *self._with_exceptions(self.defaults, step, applied)]

    def _with_exceptions(self, defaults: list[Rule], step: int, applied: frozenset) -> list[Rule]:
        rules = []
        for rule in defaults:
            opposite = self._opposite(rule.head)
            rules.append(replace(rule, absent=rule.absent | opposite))
            if (rule.text, step) in applied:
                rules.append(replace(rule, head=opposite))
        return rules

    def _applies(self, rule: Rule, state: int) -> bool:
        believed = state | self.facts
        return not rule.needed & ~believed and not rule.absent & believed

    def _set(self, literals: Iterable[Said]) -> int:
        found = 0
        for literal in literals:
            if literal not in self._bits:
                self._bits[literal] = 1 << len(self._bits)
            found |= self._bits[literal]
        return found

    def _literals(self, state: int) -> State:
        return frozenset(literal for literal, bit in self._bits.items() if bit & state)

    def _opposites(self, state: int) -> int:
        """The complements of the inertial literals of a state; their bits are neighbours."""
        return (state & self._true) << 1 | (state & self.changeable & ~self._true) >> 1

    def _opposite(self, head: int) -> int:
        ((atom, sign),) = self._literals(head)
        return self._set([(atom, not sign)])

    def _atoms(self, kind: AttributeKind) -> list[str]:
        return [
            atom
            for each in self.signature.attributes_of(kind)
            for atom in self._instances(each.name, each.arguments)
        ]

    def _instances(self, name: str, sorts: Sequence[str]) -> list[str]:
        members = [self.signature.members(sort) for sort in sorts]
        return [_atom(name, values) for values in itertools.product(*members)]

    def _ground(self, axiom: Axiom) -> Iterator[Rule]:
        """All well-sorted ground instances; conditions on statics are kept, as facts."""
        parts = (*axiom.conclusions, *axiom.premises)
        counts = [set(variables_of(part)) for part in parts]
        every = sorted({each for found in counts for each in found}, key=str)
        local = {
            variable
            for variable in every
            for part, found in zip(parts, counts, strict=True)
            if isinstance(part, Belief) and part.negated and variable in found
            if sum(variable in other for other in counts) == 1
        }
        universe = sorted(
            {member for sort in self.signature.sorts for member in self.signature.members(sort)},
            key=str,
        )
        shared = [each for each in every if each not in local]
        for values in itertools.product(universe, repeat=len(shared)):
            binding = dict(zip(shared, values, strict=True))
            rule = self._instance(axiom, binding, sorted(local, key=str), universe)
            if rule is not None:
                yield rule

    def _instance(self, axiom: Axiom, binding: dict, local: list, universe: list) -> Rule | None:
        needed, absent = set(), set()
        for premise in axiom.premises:
            if isinstance(premise, Comparison):
                sides = (_value(premise.left, binding), _value(premise.right, binding))
                if not COMPARE[premise.operator](*map(_key, sides)):
                    return None
            elif isinstance(premise, Membership):
                inside = self.signature.contains(premise.sort, _value(premise.term, binding))
                if inside == premise.negated:
                    return None
            elif premise.negated:
                own = [each for each in local if each in set(variables_of(premise))]
                inside = False
                for values in itertools.product(universe, repeat=len(own)):
                    said = self._said(
                        premise.literal, {**binding, **dict(zip(own, values, strict=True))}
                    )
                    if said is not None:
                        absent.add(said)
                        inside = True
                if not inside:
                    return None
            else:
                said = self._said(premise.literal, binding)
                if said is None:
                    return None
                needed.add(said)
        heads = []
        for head in axiom.conclusions:
            said = self._said(head if isinstance(head, Literal) else Literal(head), binding)
            if said is None:
                return None
            heads.append(said)
        acting = isinstance(axiom, ExecutabilityCondition)
        return Rule(
            head=0 if acting else self._set(heads),
            needed=self._set([*needed, *(heads if acting else ())]),
            absent=self._set(absent),
            axiom=axiom,
            text=_exception(axiom, binding),
        )

    def _said(self, literal: Literal, binding: dict) -> Said | None:
        """The ground literal, or None where it is not well-sorted."""
        atom = literal.atom
        values = [_value(term, binding) for term in atom.arguments]
        sorts = self.signature.argument_sorts(atom.name)
        if not all(map(self.signature.contains, sorts, values)):
            return None
        return _atom(atom.name, values), literal.positive


def _exception(axiom: Axiom, binding: dict) -> str:
    """How the translation calls the exception: the axiom and the variables of its head."""
    used = dict.fromkeys(variables_of(axiom.conclusions[0]))
    return f"exception({_atom(axiom.id, [binding[each] for each in used])})"


def _atom(name: str, values: Sequence[Term]) -> str:
    return f"{name}({', '.join(map(str, values))})" if values else name


def _value(term: Term, binding: dict) -> Term:
    if isinstance(term, Variable):
        return binding[term]
    if isinstance(term, Arithmetic):
        left, right = _value(term.left, binding), _value(term.right, binding)
        if not (isinstance(left, Number) and isinstance(right, Number)):
            return Variable("Undefined")  # belongs to no sort
        return Number(
            left.value + right.value if term.operator == "+" else left.value - right.value
        )
    return term


def _key(term: Term) -> tuple[int, object]:
    """clingo's order: numbers before names."""
    return (0, term.value) if isinstance(term, Number) else (1, str(term))
