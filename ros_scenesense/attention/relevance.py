"""Which spatial relations bear on a task: read off the axioms, never listed by hand.

Paper, section *Attention Mechanism and Deep Learning*: of each axiom whose head is the task's
literal, the relations in the body tell which objects matter. Fluents that are defined by state
constraints stand for the relations in their definitions.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from ros_scenesense.knowledge.axioms import Axiom, Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Atom, Belief, Condition
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Term
from ros_scenesense.messages.grounding import Relation
from ros_scenesense.scene import Distance, Position, Task

FLUENTS = {Task.STABILITY: "stable", Task.OCCLUSION: "occluded"}
"""The estimated fluent that each task is about."""

_POSITIONS = frozenset(str(position) for position in Position)
_RELATIONS = _POSITIONS | {str(distance) for distance in Distance}

Pattern = frozenset[str]
"""Relations that hold together of an ordered pair of objects, e.g. above and touching."""


@dataclass(frozen=True)
class Relevance:
    """What bears on a task.

    Attributes:
        task: The task.
        axioms: Ids of the axioms whose head is the task's literal or its complement; empty if
            there are none yet and all position relations count.
        patterns: A pair of objects matters if all relations of one pattern hold of it.
    """

    task: Task
    axioms: tuple[str, ...]
    patterns: frozenset[Pattern]

    @property
    def relations(self) -> tuple[str, ...]:
        """The relations of all patterns, in the order of the alphabet."""
        return tuple(sorted(set().union(*self.patterns)))

    def pairs(self, relations: Iterable[Relation]) -> Iterator[tuple[str, str]]:
        """The pairs of objects that matter in a scene, each once, in the order of the relations.

        Args:
            relations: One per unordered pair, in any direction; converses are understood.
        """
        for relation in relations:
            said, converse = _both_directions(relation)
            if any(pattern <= said or pattern <= converse for pattern in self.patterns):
                yield relation.object, relation.reference


def relevance(description: SystemDescription, task: Task) -> Relevance:
    """Reads the relevant relations off the axioms that are in force.

    Where no axiom has the task's literal as its head, or none of them speaks of relations, every
    position relation may matter.

    Args:
        description: The knowledge in force; axioms that are switched off are left out of it.
        task: The task.
    """
    heads = [
        axiom
        for axiom in description.axioms
        # Defaults of an initial state are about plans, not about what an image shows.
        if isinstance(axiom, StateConstraint | Default) and axiom.head.atom.name == FLUENTS[task]
    ]
    definitions = _definitions(description)
    patterns = {pattern for axiom in heads for pattern in _patterns(axiom, definitions)}
    if not patterns:
        patterns = {frozenset({name}) for name in _POSITIONS}
    return Relevance(
        task=task,
        axioms=tuple(dict.fromkeys(axiom.id for axiom in heads)),
        patterns=frozenset(patterns),
    )


def _definitions(description: SystemDescription) -> dict[str, list[Axiom]]:
    """The state constraints that define each defined fluent which is no relation itself."""
    defined = {each.name for each in description.signature.attributes_of(AttributeKind.DEFINED)}
    definitions: dict[str, list[Axiom]] = defaultdict(list)
    for axiom in description.axioms:
        if isinstance(axiom, StateConstraint) and axiom.head.atom.name in defined - _RELATIONS:
            definitions[axiom.head.atom.name].append(axiom)
    return definitions


def _patterns(axiom: Axiom, definitions: dict[str, list[Axiom]]) -> Iterator[Pattern]:
    """The patterns of an axiom's body, with defined fluents unfolded, each of them once."""
    bodies: list[Sequence[Condition]] = [axiom.body]
    unfolded: set[str] = set()
    while bodies:
        together: dict[tuple[Term, ...], set[str]] = defaultdict(set)
        for belief in (each for each in bodies.pop() if isinstance(each, Belief)):
            atom = belief.literal.atom
            if not _is_relation(atom):
                if atom.name not in unfolded:
                    unfolded.add(atom.name)
                    bodies += (each.body for each in definitions.get(atom.name, ()))
            elif belief.negated or not belief.literal.positive:
                # What must not hold is looked for by itself.
                yield frozenset({atom.name})
            else:
                together[atom.arguments].add(atom.name)
        yield from map(frozenset, together.values())


def _is_relation(atom: Atom) -> bool:
    return atom.name in _RELATIONS and len(atom.arguments) == 2


def _both_directions(relation: Relation) -> tuple[set[str], set[str]]:
    """What holds of (object, reference), and what of (reference, object)."""
    position, distance = relation.position, str(relation.distance)
    converse = {distance} if position.converse is None else {distance, str(position.converse)}
    return {distance, str(position)}, converse
