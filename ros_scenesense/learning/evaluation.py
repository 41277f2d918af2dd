"""Whether the body of an axiom holds of an object in a scene whose state is known.

Without a solver: bodies are short, scenes small, and merging asks for many axioms at once.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping, Sequence

from ros_scenesense.errors import LearningError
from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.knowledge.literals import Belief, Comparison, Condition, Literal
from ros_scenesense.knowledge.terms import Constant, Number, Term, Variable
from ros_scenesense.learning.examples import SceneState

Value = str | int
Binding = Mapping[Variable, Value]

_COMPARE: dict[str, Callable[[Value, Value], bool]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def can_be_evaluated(axiom: object) -> bool:
    """Whether an axiom is of the kind that is learned: about one object, with a plain body."""
    return (
        isinstance(axiom, StateConstraint | Default)
        and len(axiom.head.atom.arguments) == 1
        and isinstance(axiom.head.atom.arguments[0], Variable)
        and all(
            isinstance(each, Belief | Comparison) and all(map(_is_plain, _terms(each)))
            for each in axiom.body
        )
    )


def holds(axiom: StateConstraint | Default, state: SceneState, target: int) -> bool:
    """Whether the body of an axiom holds, its head being about an object.

    Raises:
        LearningError: If the axiom is not `can_be_evaluated`.
    """
    if not can_be_evaluated(axiom):
        raise LearningError(f"axiom {axiom} is not about one object by a plain body")
    subject = axiom.head.atom.arguments[0]
    assert isinstance(subject, Variable)
    return satisfied(axiom.body, state, {subject: target})


def satisfied(body: Sequence[Condition], state: SceneState, binding: Binding) -> bool:
    """Whether a body of beliefs and comparisons holds in a state.

    Args:
        body: Its conditions.
        state: What holds.
        binding: What some of its variables stand for; there may be anything for the others.
    """
    return _satisfied(_in_order(body), state, binding)


def _in_order(body: Sequence[Condition]) -> list[Belief | Comparison]:
    """What binds variables before what only asks about them."""
    beliefs = [each for each in body if isinstance(each, Belief)]
    binding = [each for each in beliefs if _binds(each)]
    asking = [each for each in beliefs if not _binds(each)]
    return [*binding, *(each for each in body if isinstance(each, Comparison)), *asking]


def _binds(belief: Belief) -> bool:
    return not belief.negated and belief.literal.positive


def _satisfied(
    conditions: Sequence[Belief | Comparison], state: SceneState, binding: Binding
) -> bool:
    if not conditions:
        return True
    first, rest = conditions[0], conditions[1:]
    if isinstance(first, Comparison):
        left, right = _value(first.left, binding), _value(first.right, binding)
        if left is None or right is None or isinstance(left, str) != isinstance(right, str):
            return False
        return _COMPARE[first.operator](left, right) and _satisfied(rest, state, binding)
    if _binds(first):
        return any(
            _satisfied(rest, state, found) for found in _matches(first.literal, state, binding)
        )
    # Of `-p` and `not p` the same is true here: everything is known of the scene.
    matches = any(True for _ in _matches(first.literal, state, binding))
    denied = first.literal.positive == first.negated
    denies = not first.literal.positive and not first.negated
    return (not matches if denied or denies else matches) and _satisfied(rest, state, binding)


def _matches(literal: Literal, state: SceneState, binding: Binding) -> Iterator[Binding]:
    terms = literal.atom.arguments
    for arguments in state.by_name.get(literal.atom.name, ()):
        found = dict(binding)
        if len(arguments) == len(terms) and all(
            _unify(term, value, found) for term, value in zip(terms, arguments, strict=True)
        ):
            yield found


def _unify(term: Term, value: Value, binding: dict[Variable, Value]) -> bool:
    if isinstance(term, Variable):
        return binding.setdefault(term, value) == value
    return _value(term, binding) == value


def _value(term: Term, binding: Binding) -> Value | None:
    if isinstance(term, Variable):
        return binding.get(term)
    if isinstance(term, Constant):
        return term.name
    return term.value if isinstance(term, Number) else None


def _is_plain(term: Term) -> bool:
    return isinstance(term, Variable | Constant | Number)


def _terms(condition: Belief | Comparison) -> tuple[Term, ...]:
    if isinstance(condition, Belief):
        return condition.literal.atom.arguments
    return (condition.left, condition.right)
