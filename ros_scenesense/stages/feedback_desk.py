"""Judges what people say of a scene: what counts, what is refused and why, and what it changes.

About a pair of objects, its position and its distance can each be told once in a scene. Who says
the same again is not counted twice; who says otherwise corrects what was said before.
"""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from ros_scenesense.grounding.control import SWITCH, Control
from ros_scenesense.grounding.trust import Kind, Model, TrustState
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import (
    Feedback,
    FeedbackResult,
    Groundings,
    KindTrust,
    MsrSample,
    PairGrounding,
    Relations,
    Trust,
)
from ros_scenesense.scene import Distance
from ros_scenesense.stages.control_ledger import ControlLedger, Entry
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.statements import Statement, name_of

_NAMES_LISTED = 10


class FeedbackDesk:
    """Takes feedback one by one.

    Args:
        ledger: Remembers what counts.
        control: Its trust follows what counts; all that the ledger holds is taught to it here.
        health: Counts what is accepted, refused, repeated.

    Attributes:
        trust: As it is published.
    """

    def __init__(self, ledger: ControlLedger, control: Control, health: Health) -> None:
        self._ledger = ledger
        self._control = control
        self._health = health
        self._replay(ledger.entries())
        last = ledger.trust()
        self.trust = self._trust(
            revision=0 if last is None else last.revision,
            stamp=Stamp.of(0) if last is None else last.stamp,
            changed=last is not None and last.viewpoint_changed,
        )

    def take(self, feedback: Feedback, now_ns: int) -> FeedbackResult:
        """Judges a feedback; if it counts, the ledger and the trust are new afterwards."""
        verdict = self._judge(feedback, now_ns)
        self._health.count(f"feedback_{verdict.outcome}")
        return FeedbackResult(
            stamp=Stamp.of(now_ns),
            id=feedback.id or _content_id(feedback, verdict.scene_id),
            outcome=verdict.outcome,
            reason=verdict.reason,
            scene_id=verdict.scene_id,
        )

    def _judge(self, feedback: Feedback, now_ns: int) -> _Verdict:
        statement = Statement.of(feedback)
        if feedback.object == feedback.reference:
            return _Verdict("refused", "an object is in no relation to itself", feedback.scene_id)
        before = self._ledger.feedback_of(feedback.id) if feedback.id else None
        if before is not None:
            return _Verdict("duplicate", _same_id(before, statement, feedback), before.scene_id)
        scene_id = feedback.scene_id or self._newest_with(*statement.pair)
        groundings = None if scene_id is None else self._ledger.groundings(scene_id)
        if scene_id is None or groundings is None:
            return _Verdict("refused", self._why_no_scene(feedback), feedback.scene_id)
        missing = [name for name in statement.pair if name not in _names(groundings)]
        if missing:
            return _Verdict("refused", _not_located(missing, groundings), scene_id)
        standing = self._ledger.standing(scene_id, statement)
        if standing is not None and standing.statement == statement:
            return _Verdict("duplicate", f"{statement} was said of this scene before", scene_id)
        grounded = (
            _pair(groundings, *_names_of(statement)),
            _pair(groundings, *reversed(_names_of(statement))),
        )
        entry = Entry(
            id=feedback.id or None,
            stamp_ns=feedback.stamp.nanoseconds if feedback.stamp else now_ns,
            scene_id=scene_id,
            statement=statement,
            grounded=grounded,
            passed_on=_passes(self._ledger.relations(scene_id), statement),
        )
        return self._accept(entry, standing)

    def _accept(self, entry: Entry, replaced: Entry | None) -> _Verdict:
        statement, before = entry.statement, self._control.state
        if replaced is not None:
            self._replay(one for one in self._ledger.entries() if one != replaced)
        learned = self._control.learn(statement.relation, *entry.grounded)
        trust = self._trust(
            self.trust.revision + 1, Stamp.of(entry.stamp_ns), changed=learned.dropped
        )
        sample = MsrSample(
            scene_id=entry.scene_id,
            object=statement.object,
            reference=statement.reference,
            relation=name_of(statement.relation),
            source="human",
        )
        try:
            self._ledger.record_feedback(entry, trust, [sample], learned.dropped)
        except sqlite3.Error as error:
            self._control.state = before
            self._health.problem("not_remembered", f"feedback could not be written: {error}")
            return _Verdict("refused", f"it could not be written: {error}", entry.scene_id)
        self.trust = trust
        words = f"{statement} counts"
        if replaced is not None:
            words += f", and {replaced.statement}, which was said before, no longer does"
        said = [
            f"{model.upper()} had said {'the same' if agrees else 'otherwise'}"
            for model, agrees in learned.agreed.items()
        ]
        words = "; ".join([words, *said])
        if learned.dropped:
            words += "; so much of late was otherwise that the viewpoint seems to have changed"
        return _Verdict("accepted", words, entry.scene_id)

    def _replay(self, entries: Iterable[Entry]) -> None:
        """Trust after this feedback and no other."""
        self._control.state = TrustState()
        for entry in entries:
            self._control.learn(entry.statement.relation, *entry.grounded)

    def _trust(self, revision: int, stamp: Stamp, changed: bool) -> Trust:
        control = self._control
        return Trust(
            stamp=stamp,
            revision=revision,
            qsr=control.trust(Model.QSR),
            msr=control.trust(Model.MSR),
            feedback_count=control.state.feedback_count,
            viewpoint_changed=changed,
            mode="switch" if control.mode == SWITCH else "arbiter",
            kinds=[
                KindTrust(
                    kind=kind.value,
                    qsr=control.trust(Model.QSR, kind),
                    msr=control.trust(Model.MSR, kind),
                )
                for kind in Kind
            ],
        )

    def _newest_with(self, first: str, second: str) -> str | None:
        for scene_id, names in self._ledger.scenes():
            if first in names and second in names:
                return scene_id
        return None

    def _why_no_scene(self, feedback: Feedback) -> str:
        scenes = list(self._ledger.scenes())
        if not scenes:
            return "no scene was seen yet"
        if feedback.scene_id is not None:
            if self._ledger.knows(feedback.scene_id):
                return (
                    f"scene {feedback.scene_id} is too old: of the last {len(scenes)} scenes, the "
                    f"oldest is {scenes[-1][0]}"
                )
            return f"scene {feedback.scene_id} is unknown, the newest is {scenes[0][0]}"
        known = {name for _, names in scenes for name in names}
        unknown = [name for name in (feedback.object, feedback.reference) if name not in known]
        if unknown:
            words = " and ".join(f"'{name}'" for name in unknown)
            return (
                f"{words} was located in none of the last {len(scenes)} scenes; in the newest, "
                f"{scenes[0][0]}: {_listed(scenes[0][1])}"
            )
        return f"'{feedback.object}' and '{feedback.reference}' were located in no scene together"


@dataclass(frozen=True)
class _Verdict:
    outcome: Literal["accepted", "refused", "duplicate"]
    reason: str
    scene_id: str | None


def _content_id(feedback: Feedback, scene_id: str | None) -> str:
    words = "\n".join([scene_id or "", feedback.relation, feedback.object, feedback.reference])
    return f"content-{hashlib.sha256(words.encode()).hexdigest()[:32]}"


def _same_id(before: Entry, statement: Statement, feedback: Feedback) -> str:
    if before.statement == statement and feedback.scene_id in (None, before.scene_id):
        return f"{statement} came with this id before"
    return f"this id came with {before.statement} before: leave the id out, or choose another one"


def _not_located(missing: list[str], groundings: Groundings) -> str:
    words = " and ".join(f"'{name}'" for name in missing)
    return (
        f"{words} is not located in scene {groundings.scene_id}; located are: "
        f"{_listed(sorted(_names(groundings)))}"
    )


def _listed(names: list[str]) -> str:
    more = len(names) - _NAMES_LISTED
    listed = ", ".join(names[:_NAMES_LISTED]) or "nothing"
    return f"{listed} and {more} more" if more > 0 else listed


def _names(groundings: Groundings) -> set[str]:
    return {name for pair in groundings.pairs for name in (pair.object, pair.reference)}


def _names_of(statement: Statement) -> tuple[str, str]:
    return statement.object, statement.reference


def _pair(groundings: Groundings, object: str, reference: str) -> PairGrounding | None:
    for pair in groundings.pairs:
        if (pair.object, pair.reference) == (object, reference):
            return pair
    return None


def _passes(relations: Relations | None, statement: Statement) -> bool:
    """Whether the relations of a scene say what the statement says."""
    for one in relations.relations if relations else []:
        if {one.object, one.reference} == set(statement.pair):
            if isinstance(statement.relation, Distance):
                return one.distance is statement.relation
            return Statement(one.object, one.reference, one.position) == statement
    return False
