"""What of a domain bears on a question: all else is left out of the program that answers it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from ros_scenesense.knowledge.axioms import (
    Axiom,
    CausalLaw,
    Default,
    ExecutabilityCondition,
    InitialDefault,
    StateConstraint,
)
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Belief, Literal
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.sorting import local_variables


class Relevance:
    """What bears on a question about the states that actions lead to.

    Args:
        description: The domain.
        asked: Literals of the question.
        initial: What is true at first.
        exogenous: Whether actions may occur that the robot does not do.

    Attributes:
        attributes: Names of the attributes that the asked literals and the preconditions of the
            actions rest on.
        possible: Those of them that can be true in some state, as far as names tell.
        both_ways: Inertial fluents whose falsehood needs an atom of its own.
    """

    def __init__(
        self,
        description: SystemDescription,
        asked: Iterable[Literal],
        initial: Iterable[Literal],
        exogenous: bool,
    ) -> None:
        self._description = description
        self._occurring = {
            action.name
            for action in description.signature.actions.values()
            if exogenous or not action.exogenous
        }
        self.attributes = self._closure({literal.atom.name for literal in asked})
        self._true = self._ever_true(initial)
        self.possible = self._true & self.attributes
        self.both_ways = self._needed_as_false() & self.attributes

    def bears(self, axiom: Axiom) -> bool:
        """Whether an axiom does: it is about what is relevant, and can apply in some state.

        What is never true need not be made false.
        """
        if isinstance(axiom, CausalLaw) and axiom.effect.atom.name not in self.possible:
            return False
        return self._concludes(axiom, self.attributes) and self._can_apply(axiom, self._true)

    def _closure(self, asked: Collection[str]) -> frozenset[str]:
        found = set(asked)
        waiting = list(self._description.axioms)
        grown = True
        while grown:
            grown, rest = False, []
            for axiom in waiting:
                if self._concludes(axiom, found):
                    found |= set(self._believed_in(axiom))
                    grown = True
                else:
                    rest.append(axiom)
            waiting = rest
        return frozenset(found)

    def _concludes(self, axiom: Axiom, names: Collection[str]) -> bool:
        if isinstance(axiom, ExecutabilityCondition):
            return all(action.name in self._occurring for action in axiom.actions)
        if isinstance(axiom, InitialDefault):
            return False
        if isinstance(axiom, CausalLaw) and axiom.action.name not in self._occurring:
            return False
        return any(
            isinstance(head, Literal) and head.atom.name in names for head in axiom.conclusions
        )

    def _believed_in(self, axiom: Axiom) -> Iterator[str]:
        """Names of the attributes in its body; there may be actions too."""
        for condition in axiom.body:
            if isinstance(condition, Belief):
                name = condition.literal.atom.name
                if name in self._description.signature.attributes:
                    yield name

    def _ever_true(self, initial: Iterable[Literal]) -> frozenset[str]:
        known = (*initial, *self._description.facts)
        found = {literal.atom.name for literal in known if literal.positive}
        grown = True
        while grown:
            grown = False
            for axiom in self._description.axioms:
                for head in axiom.conclusions:
                    if not isinstance(head, Literal) or not head.positive:
                        continue
                    if head.atom.name not in found and self._can_apply(axiom, found):
                        found.add(head.atom.name)
                        grown = True
        return frozenset(found)

    def _can_apply(self, axiom: Axiom, possible: Collection[str]) -> bool:
        if isinstance(axiom, CausalLaw) and axiom.action.name not in self._occurring:
            return False
        return all(
            condition.negated
            or not condition.literal.positive
            or condition.literal.atom.name in possible
            or condition.literal.atom.name in self._occurring
            for condition in axiom.body
            if isinstance(condition, Belief)
        )

    def _needed_as_false(self) -> frozenset[str]:
        """Fluents of which a body says that they are false, where `not p` would not say the same.

        A state constraint that concludes an inertial literal from it would take back, by inertia,
        what it has itself derived; and there is no `not p` for all instances of a fluent at once.
        """
        needed: set[str] = set()
        for axiom in self._description.axioms:
            head = axiom.head if isinstance(axiom, StateConstraint) else None
            for condition in axiom.body:
                if not isinstance(condition, Belief) or condition.literal.positive:
                    continue
                atom = condition.literal.atom
                if not self._is_inertial(atom.name):
                    continue
                if head is not None and self._is_inertial(head.atom.name):
                    needed |= {atom.name, head.atom.name}
                elif condition.negated:
                    local = local_variables(axiom.conclusions, axiom.premises)
                    if not local.isdisjoint(atom.arguments):
                        needed.add(atom.name)
        return frozenset(needed)

    def _is_inertial(self, name: str) -> bool:
        attribute = self._description.signature.attributes.get(name)
        return attribute is not None and attribute.kind is AttributeKind.INERTIAL


def without_excuses(
    description: SystemDescription, asked: Collection[Literal], avoided: Collection[Literal]
) -> SystemDescription:
    """The domain without defaults that conclude the opposite of what is to be avoided.

    Where defaults contradict each other, what is to be avoided counts as likely: only what is sure
    speaks against it. Such a default stays where the question or another axiom needs it.

    Args:
        description: The domain.
        asked: Literals of the question.
        avoided: Literals that no action should bring about.
    """
    believed = {
        condition.literal.atom.name
        for axiom in description.axioms
        for condition in axiom.body
        if isinstance(condition, Belief)
    }
    needed = {(each.atom.name, each.positive) for each in asked}
    opposite = {(each.atom.name, not each.positive) for each in avoided} - needed
    excuses = {
        axiom.id
        for axiom in description.axioms
        if isinstance(axiom, Default)
        and axiom.head.atom.name not in believed
        and (axiom.head.atom.name, axiom.head.positive) in opposite
    }
    return description.without(excuses)
