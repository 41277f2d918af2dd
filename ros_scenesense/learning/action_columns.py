"""The relational description of an attempt at an action, from the signature of the domain alone.

Each column is a question about the action's arguments in the state before it: a static or fluent of
one of them, how two of them stand to each other, whether one stands in a relation to some other
object, whether a number exceeds a threshold.
"""

from __future__ import annotations

import string
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Atom, Belief, Comparison, Condition, Literal
from ros_scenesense.knowledge.signature import Attribute, AttributeKind, Signature
from ros_scenesense.knowledge.terms import Constant, Number, Term, Variable
from ros_scenesense.learning.bodies import Body
from ros_scenesense.learning.columns import Column, Table, bits_of
from ros_scenesense.learning.evaluation import Binding
from ros_scenesense.learning.examples import SceneState
from ros_scenesense.learning.trials import Trial

ANOTHER = Variable("Another")
"""Stands in a column for what is no argument of the action."""

_KINDS = (AttributeKind.STATIC, AttributeKind.INERTIAL, AttributeKind.DEFINED)


def variables_of_action(description: SystemDescription, action: str) -> tuple[Variable, ...]:
    """How the arguments of an action are called: who acts by its sort, things in order A, B, ..."""
    signature = description.signature
    letters = iter(string.ascii_uppercase)
    found: list[Variable] = []
    for sort in signature.actions[action].arguments:
        initial = Variable(sort[0].upper())
        acts = not any(signature.is_subsort(each, sort) for each in _described(signature))
        free = (Variable(each) for each in letters if Variable(each) not in found)
        found.append(initial if acts and initial not in found else next(free))
    return tuple(found)


def action_columns(description: SystemDescription, action: str) -> list[Column]:
    """The columns for attempts at an action; plain ones before those that speak of others."""
    signature = description.signature
    sorts = signature.actions[action].arguments
    variables = dict(zip(variables_of_action(description, action), sorts, strict=True))
    columns = [
        Column("=", (Comparison("=", each, value),), (Comparison("!=", each, value),))
        for each, sort in variables.items()
        for value in signature.members(sort)
        if isinstance(value, Constant)
    ]
    for attribute in signature.attributes_of(*_KINDS):
        columns += _about(attribute, variables, signature)
    columns.sort(key=lambda each: ANOTHER in _terms(each.if_true))
    return columns


def table_of(
    columns: Sequence[Column],
    variables: Sequence[Variable],
    trials: Sequence[Trial],
    labels: Sequence[bool],
) -> Table:
    """Asks every column about every trial. Of columns with equal answers the first stays."""
    whole = (1 << len(trials)) - 1
    bindings = [binding_of(variables, each) for each in trials]
    kept: dict[int, Column] = {}
    for column in columns:
        answers = bits_of(
            _holds(column, each.state, binding)
            for each, binding in zip(trials, bindings, strict=True)
        )
        if answers not in (0, whole):
            kept.setdefault(answers, column)
    return Table(tuple(kept.values()), tuple(kept), bits_of(labels), len(trials))


def binding_of(variables: Sequence[Variable], trial: Trial) -> Binding:
    """What the variables of an action stand for in a trial."""
    return dict(zip(variables, trial.arguments, strict=True))


def conditions_of(table: Table, body: Body, variables: Sequence[Variable]) -> tuple[Condition, ...]:
    """What tests say, every other object by a variable of its own."""
    taken = {each.name for each in variables}
    names = (Variable(each) for each in string.ascii_uppercase if each not in taken)
    conditions: list[Condition] = []
    # What holds before what does not, so that it reads well.
    for number, answer in sorted(body, key=lambda test: (not test[1], test[0])):
        column = table.columns[number]
        said = column.if_true if answer else column.if_false
        assert said is not None
        if ANOTHER in _terms(said):
            own = next(names)
            said = tuple(_renamed(each, own) for each in said)
        conditions += [each for each in said if each not in conditions]
    return tuple(conditions)


def _about(
    attribute: Attribute, variables: Mapping[Variable, str], signature: Signature
) -> Iterator[Column]:
    options = [_options(sort, variables, signature) for sort in attribute.arguments]
    for arguments in product(*options):
        known = [each for each in arguments if each in variables]
        if not known or len(set(known)) < len(known) or arguments.count(ANOTHER) > 1:
            continue
        has = Belief(Literal(Atom(attribute.name, arguments)))
        if ANOTHER not in arguments:
            denied = Belief(has.literal, negated=True)
            yield Column(attribute.name, (has,), (denied,))
            continue
        bounds = signature.sorts[attribute.arguments[arguments.index(ANOTHER)]].bounds
        if bounds is None:
            yield Column(attribute.name, (has,), (Belief(has.literal, negated=True),))
            continue
        for level in map(Number, range(bounds[0], bounds[1])):
            exceeds = (has, Comparison(">", ANOTHER, level))
            below = (has, Comparison("<=", ANOTHER, level))
            yield Column(attribute.name, exceeds, below, threshold=level.value)


def _holds(column: Column, state: SceneState, binding: Binding) -> bool:
    """The same as `satisfied` of what holds where the answer is yes, without its generality."""
    said = column.if_true[0]
    if isinstance(said, Comparison):
        assert isinstance(said.left, Variable)
        return binding[said.left] == str(said.right)
    assert isinstance(said, Belief)
    wanted = []
    another = None
    for place, term in enumerate(said.literal.atom.arguments):
        if term == ANOTHER:
            another = place
        else:
            value = binding[term] if isinstance(term, Variable) else str(term)
            wanted.append((place, value))
    for arguments in state.by_name.get(column.name, ()):
        if all(arguments[place] == value for place, value in wanted):
            if column.threshold is None or another is None:
                return True
            number = arguments[another]
            if isinstance(number, int) and number > column.threshold:
                return True
    return False


def _options(sort: str, variables: Mapping[Variable, str], signature: Signature) -> list[Term]:
    """What may stand in the place of an argument."""
    options: list[Term] = [
        each
        for each, own in variables.items()
        if signature.is_subsort(own, sort) or signature.is_subsort(sort, own)
    ]
    if options or signature.sorts[sort].bounds is not None:
        options.append(ANOTHER)
    if signature.sorts[sort].bounds is None:
        options += [each for each in signature.members(sort) if isinstance(each, Constant)]
    return options


def _described(signature: Signature) -> set[str]:
    """The sorts of what statics speak of: things, not who acts."""
    return {each.arguments[0] for each in signature.attributes_of(AttributeKind.STATIC)}


def _terms(conditions: Sequence[Condition]) -> list[Term]:
    found: list[Term] = []
    for each in conditions:
        if isinstance(each, Belief):
            found += each.literal.atom.arguments
        elif isinstance(each, Comparison):
            found += (each.left, each.right)
    return found


def _renamed(condition: Condition, own: Variable) -> Condition:
    if isinstance(condition, Belief):
        atom = condition.literal.atom
        arguments = tuple(own if each == ANOTHER else each for each in atom.arguments)
        return Belief(Literal(Atom(atom.name, arguments)), condition.negated)
    if isinstance(condition, Comparison):
        left, right = (
            own if each == ANOTHER else each for each in (condition.left, condition.right)
        )
        return Comparison(condition.operator, left, right)
    return condition
