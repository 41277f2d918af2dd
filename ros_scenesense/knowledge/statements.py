"""Statements of the action language as they were written, before names and sorts are checked."""

from __future__ import annotations

from dataclasses import dataclass

from ros_scenesense.knowledge.description import Quantity
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Place, Term


@dataclass(frozen=True)
class Name:
    """A name and where it stands."""

    text: str
    place: Place


@dataclass(frozen=True)
class Negative:
    """A minus before a term: the negation of a literal, or of a number."""

    term: Expression
    place: Place


Expression = Term | Negative


@dataclass(frozen=True)
class WrittenCondition:
    """`[not] left [operator right]`."""

    negated: bool
    left: Expression
    operator: str | None
    right: Expression | None
    place: Place


@dataclass(frozen=True)
class Range:
    """`low .. high` in the declaration of a sort."""

    low: Expression
    high: Expression
    place: Place


@dataclass(frozen=True)
class SortStatement:
    """`sort name < supersorts = parts`; parts are names of subsorts, sets and ranges."""

    name: Name
    supersorts: tuple[Name, ...]
    parts: tuple[Name | tuple[Expression, ...] | Range, ...]


@dataclass(frozen=True)
class MembersStatement:
    """`sort name += set`."""

    name: Name
    members: tuple[Expression, ...]


@dataclass(frozen=True)
class ConstStatement:
    """`const name = value`."""

    name: Name
    value: Expression


@dataclass(frozen=True)
class Declaration:
    """`name(sorts)`."""

    name: Name
    sorts: tuple[Name, ...]


@dataclass(frozen=True)
class AttributesStatement:
    """`static ...` or `... fluent ...`."""

    kind: AttributeKind
    declarations: tuple[Declaration, ...]


@dataclass(frozen=True)
class ActionsStatement:
    """`action ...` or `exogenous action ...`."""

    exogenous: bool
    declarations: tuple[Declaration, ...]


@dataclass(frozen=True)
class Label:
    """`id withheld "words":` before an axiom."""

    id: Name
    withheld: bool
    words: str


@dataclass(frozen=True)
class AxiomStatement:
    """Any axiom.

    Attributes:
        form: `constraint`, `causal_law`, `impossible`, `default` or `initial_default`.
        label: If it has one.
        heads: What stands before `if`; of a causal law the effects.
        action: The action of a causal law.
        conditions: The body.
        place: Where it begins.
    """

    form: str
    label: Label | None
    heads: tuple[Expression, ...]
    action: Expression | None
    conditions: tuple[WrittenCondition, ...]
    place: Place


@dataclass(frozen=True)
class InitiallyStatement:
    """`initially l1, ..., ln`."""

    literals: tuple[Expression, ...]


@dataclass(frozen=True)
class ObservationStatement:
    """`obs(fluent, value, step)`."""

    fluent: Expression
    value: bool
    step: Expression


@dataclass(frozen=True)
class HappenedStatement:
    """`hpd(action, step)`."""

    action: Expression
    step: Expression


@dataclass(frozen=True)
class WrittenGoalCondition:
    """`[no | all | fewest] literal`."""

    quantity: Quantity
    literal: Expression


@dataclass(frozen=True)
class GoalStatement:
    """`goal name "words": conditions`."""

    name: Name
    words: str
    conditions: tuple[WrittenGoalCondition, ...]


Statement = (
    SortStatement
    | MembersStatement
    | ConstStatement
    | AttributesStatement
    | ActionsStatement
    | AxiomStatement
    | InitiallyStatement
    | ObservationStatement
    | HappenedStatement
    | GoalStatement
)
