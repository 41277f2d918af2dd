"""Without what an action is impossible, whatever it is done with.

A planner's program has `impossible a(X) if not p(X)` anyway, but makes use of it only when all
instances of the action and of its effects are grounded, also those for which p cannot hold yet.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ros_scenesense.knowledge.axioms import Axiom, ExecutabilityCondition
from ros_scenesense.knowledge.literals import Atom, Belief, Literal
from ros_scenesense.knowledge.signature import Signature
from ros_scenesense.knowledge.terms import Variable


def prerequisites(action: Atom, axioms: Iterable[Axiom], signature: Signature) -> Iterator[Literal]:
    """The literals that have to hold before an action.

    Args:
        action: With different variables as arguments, which the literals are about.
        axioms: Of the domain.
        signature: Of the domain.
    """
    for axiom in axioms:
        match axiom:
            case ExecutabilityCondition(
                actions=(Atom(action.name) as impossible,),
                body=(Belief(Literal(needed, True), True),),
            ) if _is_for_all(impossible, needed, signature):
                own = dict(zip(impossible.arguments, action.arguments, strict=True))
                yield Literal(Atom(needed.name, tuple(own[each] for each in needed.arguments)))


def _is_for_all(action: Atom, needed: Atom, signature: Signature) -> bool:
    """Whether every instance of an action needs the atom, and it is one about its arguments."""
    sorts = dict(zip(action.arguments, signature.argument_sorts(action.name), strict=True))
    if len(sorts) < len(action.arguments) or not all(isinstance(each, Variable) for each in sorts):
        return False
    # Where the atom would not be well-sorted, nothing is said about the action.
    return all(
        each in sorts and signature.is_subsort(sorts[each], sort)
        for each, sort in zip(needed.arguments, signature.argument_sorts(needed.name), strict=True)
    )
