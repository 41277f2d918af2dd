"""Relations that say the same in the other direction, said in one: programs get half as large.

`below(B, A) if above(A, B)` and `above(B, A) if below(A, B)` make the two equivalent in every
state, so each `below(X, Y)` can be written `above(Y, X)`. That leaves the transition diagram as it
is if, besides, whatever makes one false by an effect makes the other false too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ros_scenesense.knowledge.axioms import (
    Axiom,
    CausalLaw,
    Default,
    ExecutabilityCondition,
    InitialDefault,
    StateConstraint,
)
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Atom, Belief, Condition, Literal
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Variable


@dataclass(frozen=True)
class _Reading:
    """How to say an attribute by another: name, and which of its arguments comes at each place."""

    name: str
    order: tuple[int, ...]


class Converses:
    """The converse relations of a description.

    Args:
        description: The domain.

    Attributes:
        description: The same domain, each pair of converse relations said by the one that is
            declared first.
    """

    def __init__(self, description: SystemDescription) -> None:
        self._readings = _readings(description)
        axioms = dict.fromkeys(
            self._axiom(axiom) for axiom in description.axioms if not self._is_converse(axiom)
        )
        self.description = replace(description, axioms=tuple(axioms))

    def literal(self, literal: Literal) -> Literal:
        """The same literal, said by the relation that is kept."""
        reading = self._readings.get(literal.atom.name)
        if reading is None:
            return literal
        arguments = tuple(literal.atom.arguments[index] for index in reading.order)
        return Literal(Atom(reading.name, arguments, literal.atom.place), literal.positive)

    def _is_converse(self, axiom: Axiom) -> bool:
        converse = _converse(axiom)
        if converse is None:
            return False
        head, body = converse
        return self._readings.get(head.name) == _Reading(
            body.name, _order(body, head)
        ) or self._readings.get(body.name) == _Reading(head.name, _order(head, body))

    def _axiom(self, axiom: Axiom) -> Axiom:
        literals = [each.literal for each in axiom.body if isinstance(each, Belief)]
        literals += [head for head in axiom.conclusions if isinstance(head, Literal)]
        if not any(literal.atom.name in self._readings for literal in literals):
            return axiom
        body = tuple(map(self._condition, axiom.body))
        match axiom:
            case StateConstraint() | Default() | InitialDefault():
                return replace(axiom, head=self.literal(axiom.head), body=body)
            case CausalLaw():
                return replace(axiom, effect=self.literal(axiom.effect), body=body)
            case ExecutabilityCondition():
                return replace(axiom, body=body)
        return axiom

    def _condition(self, condition: Condition) -> Condition:
        if isinstance(condition, Belief):
            return replace(condition, literal=self.literal(condition.literal))
        return condition


def _readings(description: SystemDescription) -> Mapping[str, _Reading]:
    signature = description.signature
    order_of = {name: number for number, name in enumerate(signature.attributes)}
    said: dict[tuple[str, str], tuple[int, ...]] = {}
    for axiom in description.axioms:
        converse = _converse(axiom)
        if converse is not None:
            head, body = converse
            kinds = {signature.attributes[each.name].kind for each in converse}
            sorts = signature.attributes[body.name].arguments
            order = _order(head, body)
            if kinds == {AttributeKind.INERTIAL} and signature.attributes[
                head.name
            ].arguments == tuple(sorts[index] for index in order):
                said[head.name, body.name] = order
    readings: dict[str, _Reading] = {}
    for (other, name), order in said.items():
        reading = _Reading(name, _inverse(order))
        if order_of[name] > order_of[other] or name in readings or other in readings:
            continue
        if said.get((name, other)) == reading.order and _fall_together(description, other, reading):
            readings[other] = reading
    kept = {reading.name for reading in readings.values()}
    return {name: reading for name, reading in readings.items() if name not in kept}


def _converse(axiom: Axiom) -> tuple[Atom, Atom] | None:
    """Head and body of `p(A, B) if q(B, A)`; None for every other axiom."""
    if not isinstance(axiom, StateConstraint) or len(axiom.body) != 1 or not axiom.head.positive:
        return None
    (condition,) = axiom.body
    if not isinstance(condition, Belief) or condition.negated or not condition.literal.positive:
        return None
    head, body = axiom.head.atom, condition.literal.atom
    variables = set(head.arguments)
    proper = all(isinstance(each, Variable) for each in variables)
    once = len(variables) == len(head.arguments) == len(body.arguments)
    different = head.name != body.name and variables == set(body.arguments)
    return (head, body) if proper and once and different else None


def _order(head: Atom, body: Atom) -> tuple[int, ...]:
    """For each argument of the head, its place in the body."""
    return tuple(body.arguments.index(each) for each in head.arguments)


def _inverse(order: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(order.index(place) for place in range(len(order)))


def _fall_together(description: SystemDescription, name: str, reading: _Reading) -> bool:
    """Whether everything that makes one of two converse relations false makes both false."""
    names = {name, reading.name}
    falling = [
        axiom
        for axiom in description.axioms
        for head in axiom.conclusions
        if isinstance(head, Literal) and not head.positive and head.atom.name in names
    ]
    laws = {
        (axiom.action, axiom.effect.atom, axiom.body)
        for axiom in falling
        if isinstance(axiom, CausalLaw)
    }
    if any(not isinstance(axiom, CausalLaw) for axiom in falling):
        return False
    back = _inverse(reading.order)
    for action, atom, body in laws:
        order, other = (reading.order, reading.name) if atom.name == name else (back, name)
        twin = Atom(other, tuple(atom.arguments[index] for index in order))
        if (action, twin, body) not in laws:
            return False
    return True
