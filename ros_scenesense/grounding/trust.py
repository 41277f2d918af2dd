"""How far the groundings are trusted: their agreement with human feedback, by kind of relation.

Paper, section *Combined QSR-MSR Model*: trust starts high for the qualitative and low for the
metric grounding, and follows the share of feedback that each agrees with. Here it is kept for each
kind of relation, and for the present viewpoint: when agreement suddenly drops, what was found
before counts little.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import msgspec

from ros_scenesense.scene import Distance, Position


class Kind(StrEnum):
    """Kinds of relations that a grounding may know well or badly."""

    CONTAINMENT = "containment"
    VERTICAL = "vertical"
    HORIZONTAL = "horizontal"
    DISTANCE = "distance"

    @classmethod
    def of(cls, relation: Position | Distance) -> Kind:
        """The kind of a relation."""
        if isinstance(relation, Distance):
            return cls.DISTANCE
        if relation is Position.IN:
            return cls.CONTAINMENT
        vertical = relation in (Position.ABOVE, Position.BELOW)
        return cls.VERTICAL if vertical else cls.HORIZONTAL


class Model(StrEnum):
    """The two groundings."""

    QSR = "qsr"
    MSR = "msr"


class Agreement(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Of how many feedbacks a grounding named so many rightly; older ones count less."""

    right: float = 0.0
    given: float = 0.0

    def after(self, is_right: bool) -> Agreement:
        """With one more feedback."""
        return Agreement(self.right + is_right, self.given + 1.0)

    def faded(self, given: float) -> Agreement:
        """The same share, of no more than so many feedbacks."""
        if self.given <= given:
            return self
        return Agreement(self.right * given / self.given, given)


class TrustState(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All that control remembers; can be written as JSON and read again.

    Attributes:
        qsr: Agreement of the qualitative grounding by kind of relation.
        msr: The same of the metric grounding.
        qsr_alone: By kind of relation that the qualitative grounding named, how often it alone was
            right.
        msr_alone: By the same kinds, how often the metric grounding alone was right.
        alarms: By kind of relation, how much speaks for a drop of agreement (log likelihood ratio).
        viewpoint: How often agreement dropped so far.
        feedback_count: Feedbacks since the start.
    """

    qsr: dict[Kind, Agreement] = {}
    msr: dict[Kind, Agreement] = {}
    qsr_alone: dict[Kind, float] = {}
    msr_alone: dict[Kind, float] = {}
    alarms: dict[Kind, float] = {}
    viewpoint: int = 0
    feedback_count: int = 0

    def of(self, model: Model, kind: Kind) -> Agreement:
        """Agreement of a grounding on a kind of relation."""
        return (self.qsr if model is Model.QSR else self.msr).get(kind, Agreement())


@dataclass(frozen=True)
class TrustSettings:
    """Where trust starts and how it moves.

    Attributes:
        qsr: Trust in the qualitative grounding before any feedback.
        msr: Trust in the metric grounding before any feedback.
        weight: What is believed before any feedback counts as much as so many feedbacks.
        remembered: After a drop, earlier feedback counts as much as so many.
        dropped: A drop is a fall of the share of agreement to this part of what it was.
        alarm: Log likelihood ratio at which a drop is believed.
    """

    qsr: float = 0.9
    msr: float = 0.1
    weight: float = 2.0
    remembered: float = 2.0
    dropped: float = 0.5
    alarm: float = 5.0


# People err: never is more agreement expected, and where less is, its loss would not be noticed.
_MOST_EXPECTED = 0.9
_LEAST_EXPECTED = 0.6


def trust_in(state: TrustState, model: Model, settings: TrustSettings, kind: Kind | None) -> float:
    """Trust in a grounding on a kind of relation, or overall: share of agreement, from a prior."""
    kinds = list(Kind) if kind is None else [kind]
    agreements = [state.of(model, one) for one in kinds]
    start = settings.qsr if model is Model.QSR else settings.msr
    right = sum(one.right for one in agreements) + settings.weight * start
    return right / (sum(one.given for one in agreements) + settings.weight)


def odds_for_msr(state: TrustState, settings: TrustSettings, kind: Kind) -> float:
    """How much more likely the metric grounding is right where the two disagree: log odds.

    From the feedback on which only one of them was right: the rest says nothing of whom to follow.
    What is not known yet of a kind of position is taken to be as with the other kinds.

    Args:
        state: What was found so far.
        settings: Where trust starts.
        kind: Of the relation that the qualitative grounding names.
    """
    qsr, msr = settings.weight * settings.qsr, settings.weight * settings.msr
    if kind is not Kind.DISTANCE:
        others = [one for one in Kind if one is not Kind.DISTANCE]
        qsr += sum(state.qsr_alone.get(one, 0.0) for one in others)
        msr += sum(state.msr_alone.get(one, 0.0) for one in others)
        scale = settings.weight / (qsr + msr) if qsr + msr > 0.0 else 0.0
        qsr, msr = scale * qsr, scale * msr
    qsr += state.qsr_alone.get(kind, 0.0)
    msr += state.msr_alone.get(kind, 0.0)
    return math.log((msr + _LEAST) / (qsr + _LEAST))


# Also a trust of zero may be overcome.
_LEAST = 1e-3


def with_feedback(
    state: TrustState,
    kind: Kind,
    right: dict[Model, bool],
    charge: Model,
    named: Kind,
    settings: TrustSettings,
) -> tuple[TrustState, bool]:
    """The state after a feedback, and whether agreement is now thought to have dropped.

    Args:
        state: Before.
        kind: Of the relation that the person named.
        right: Whether a grounding had named it so, if it named anything.
        charge: Which grounding's word was passed on.
        named: Kind of the relation that the qualitative grounding had named.
        settings: How trust moves.
    """
    expected = min(_MOST_EXPECTED, trust_in(state, charge, settings, kind))
    dropped = settings.dropped * expected
    alarm = state.alarms.get(kind, 0.0)
    if expected < _LEAST_EXPECTED:
        alarm = 0.0
    elif charge in right:
        agreed = right[charge]
        gain = dropped / expected if agreed else (1.0 - dropped) / (1.0 - expected)
        alarm = max(0.0, alarm + math.log(gain))
    is_drop = alarm >= settings.alarm
    qsr, msr = dict(state.qsr), dict(state.msr)
    alone = {Model.QSR: dict(state.qsr_alone), Model.MSR: dict(state.msr_alone)}
    if is_drop:
        alone = _faded(alone, settings.remembered)
    for model, table in ((Model.QSR, qsr), (Model.MSR, msr)):
        if is_drop:
            table[kind] = state.of(model, kind).faded(settings.remembered)
        if model in right:
            table[kind] = table.get(kind, Agreement()).after(right[model])
    if len(right) == 2 and right[Model.QSR] != right[Model.MSR]:
        winner = Model.QSR if right[Model.QSR] else Model.MSR
        alone[winner][named] = alone[winner].get(named, 0.0) + 1.0
    after = TrustState(
        qsr=qsr,
        msr=msr,
        qsr_alone=alone[Model.QSR],
        msr_alone=alone[Model.MSR],
        alarms=state.alarms | {kind: 0.0 if is_drop else alarm},
        viewpoint=state.viewpoint + is_drop,
        feedback_count=state.feedback_count + 1,
    )
    return after, is_drop


def _faded(alone: dict[Model, dict[Kind, float]], given: float) -> dict[Model, dict[Kind, float]]:
    """The same shares, of no more than so many feedbacks of each kind."""
    totals = {kind: sum(one.get(kind, 0.0) for one in alone.values()) for kind in Kind}
    return {
        model: {kind: count * given / max(given, totals[kind]) for kind, count in counts.items()}
        for model, counts in alone.items()
    }
