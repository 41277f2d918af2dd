"""Which axioms are versions of the same one: same head, and the body of one holds all of another.

Paper, *Decision Tree Induction and Axiom Merging*: "two axioms may have identical heads with one
axiom's body containing all the literals of the other, or ... sorts that are subsorts of a more
general sort".
"""

from __future__ import annotations

from collections.abc import Sequence

from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.knowledge.literals import (
    Atom,
    Belief,
    Comparison,
    Condition,
    Literal,
    Membership,
    variables_of,
)
from ros_scenesense.knowledge.signature import Signature
from ros_scenesense.knowledge.terms import Term, Variable
from ros_scenesense.learning.columns import OBJECT

AxiomData = StateConstraint | Default


def grouped(axioms: Sequence[AxiomData], signature: Signature) -> list[list[AxiomData]]:
    """Groups of two or more versions, the most general one of each first.

    An axiom that is a special case of several others belongs to the group of the one it shares most
    with, so that axioms that say different things are never set against each other.
    """
    groups: dict[str, list[AxiomData]] = {}
    general = [
        one
        for one in axioms
        if not any(
            is_special_case(one, other, signature)
            and not (is_special_case(other, one, signature) and one.id <= other.id)
            for other in axioms
            if other is not one
        )
    ]
    for one in axioms:
        if one in general:
            groups.setdefault(one.id, []).insert(0, one)
            continue
        homes = [other for other in general if is_special_case(one, other, signature)]
        home = max(homes, key=lambda other: (len(other.body), other.id))
        groups.setdefault(home.id, []).append(one)
    return [group for group in groups.values() if len(group) > 1]


def same_statement(one: AxiomData, other: AxiomData, signature: Signature) -> bool:
    """Whether two axioms say the same, whatever their variables and the order of their bodies."""
    return (
        one.kind == other.kind
        and len(one.body) == len(other.body)
        and is_special_case(one, other, signature)
        and is_special_case(other, one, signature)
    )


def is_special_case(one: AxiomData, general: AxiomData, signature: Signature) -> bool:
    """Whether an axiom has the head of another and all conditions of its body, or narrower ones."""
    first, second = _subject(one), _subject(general)
    if str(_head(one, first)) != str(_head(general, second)):
        return False
    said = [(each, _plain(each, first)) for each in one.body]
    return all(
        any(
            text == _plain(condition, second) or _is_below(each, condition, signature)
            for each, text in said
        )
        for condition in general.body
    )


def _is_below(one: Condition, general: Condition, signature: Signature) -> bool:
    """Whether one condition names a subsort of what the other names."""
    return (
        isinstance(one, Membership)
        and isinstance(general, Membership)
        and not one.negated
        and not general.negated
        and signature.is_subsort(one.sort, general.sort)
    )


def _subject(axiom: AxiomData) -> Variable | None:
    return next(iter(variables_of(axiom.head)), None)


def _head(axiom: AxiomData, subject: Variable | None) -> Literal:
    return Literal(_renamed(axiom.head.atom, subject), axiom.head.positive)


def _plain(condition: Condition, subject: Variable | None) -> str:
    """The text of a condition, whatever its variables are called but for the subject."""
    if isinstance(condition, Belief):
        literal = Literal(_renamed(condition.literal.atom, subject), condition.literal.positive)
        return str(Belief(literal, condition.negated))
    if isinstance(condition, Comparison):
        left, right = (_name(each, subject) for each in (condition.left, condition.right))
        return str(Comparison(condition.operator, left, right))
    return str(Membership(condition.sort, _name(condition.term, subject), condition.negated))


def _renamed(atom: Atom, subject: Variable | None) -> Atom:
    return Atom(atom.name, tuple(_name(each, subject) for each in atom.arguments))


def _name(term: Term, subject: Variable | None) -> Term:
    if isinstance(term, Variable):
        return OBJECT if term == subject else Variable("X")
    return term
