"""What sorts mean for variables: which are local, and what keeps an instance well-sorted.

An instance of an axiom exists only where every atom in it is well-sorted, also where arithmetic
computes an argument. A logic program has no sorts; guards in the bodies of its rules say the same.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from ros_scenesense.knowledge.axioms import Axiom
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
from ros_scenesense.knowledge.terms import Term, Variable, variables

Head = Literal | Atom


@dataclass(frozen=True, slots=True)
class Guard:
    """The demand that a term belongs to a sort."""

    sort: str
    term: Term


def local_variables(heads: Iterable[Head], premises: Sequence[Condition]) -> frozenset[Variable]:
    """The variables that occur in one negated belief and nowhere else.

    They are quantified there: `not above(A, B)`, A is above no B.
    """
    if not any(isinstance(each, Belief) and each.negated for each in premises):
        return frozenset()
    elsewhere = {each for head in heads for each in variables_of(head)}
    seen: Counter[Variable] = Counter()
    for premise in premises:
        for variable in set(variables_of(premise)):
            seen[variable] += 1
            if not (isinstance(premise, Belief) and premise.negated):
                elsewhere.add(variable)
    return frozenset(each for each, count in seen.items() if count == 1 and each not in elsewhere)


def guards(axiom: Axiom, signature: Signature) -> tuple[Guard, ...]:
    """What must be demanded beside the axiom's premises; nothing that these imply already.

    Facts and conclusions are well-sorted, so whatever a premise believes in is. A guard is left out
    where a guard of a sort below it says more.
    """
    return guards_of(axiom.conclusions, axiom.premises, signature)


def guards_of(
    heads: Iterable[Head], premises: Sequence[Condition], signature: Signature
) -> tuple[Guard, ...]:
    """The same for heads and premises that are no axiom, e.g. a goal's."""
    heads = tuple(heads)
    local = local_variables(heads, premises)
    asked: dict[Guard, None] = {}
    given: set[Guard] = set()
    for head in heads:
        asked.update(dict.fromkeys(_demands(head, signature)))
    for premise in premises:
        match premise:
            case Belief(literal, negated):
                if negated:
                    asked.update(dict.fromkeys(_demands(literal, signature)))
                else:
                    given.update(_demands(literal, signature))
            case Membership(sort, term, False):
                given.add(Guard(sort, term))
            case Comparison() | Membership():
                pass
    return tuple(
        guard
        for guard in asked
        if guard not in given
        and local.isdisjoint(variables(guard.term))
        and not any(
            other.term == guard.term
            and other.sort != guard.sort
            and signature.is_subsort(other.sort, guard.sort)
            for other in (*asked, *given)
        )
    )


def sorts_of(
    variable: Variable, heads: Iterable[Head], premises: Iterable[Condition], signature: Signature
) -> tuple[str, ...]:
    """The sorts that a variable must belong to, as an argument; each once, none above another."""
    found: dict[str, None] = {}
    for part in (*heads, *premises):
        if isinstance(part, Membership):
            if part.term == variable and not part.negated:
                found[part.sort] = None
        elif not isinstance(part, Comparison):
            literal = part.literal if isinstance(part, Belief) else part
            for guard in _demands(literal, signature):
                if guard.term == variable:
                    found[guard.sort] = None
    return tuple(
        sort
        for sort in found
        if not any(other != sort and signature.is_subsort(other, sort) for other in found)
    )


def _demands(part: Head, signature: Signature) -> Iterator[Guard]:
    """The sort that each argument with variables must belong to."""
    atom = part.atom if isinstance(part, Literal) else part
    for sort, term in zip(signature.argument_sorts(atom.name), atom.arguments, strict=True):
        if any(True for _ in variables(term)):
            yield Guard(sort, term)
