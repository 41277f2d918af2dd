"""What becomes of learned axioms: cycles strengthen or forget them, people pin and veto them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from ros_scenesense.learning.scoring import TRUE_FROM
from ros_scenesense.learning.strength import FORGOTTEN_BELOW, Strength
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.learning import AxiomRequest, Axioms, JobProgress, LearnedAxiom
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.learner_store import (
    Changes,
    Event,
    LearnerStore,
    Outcome,
    StoredAxiom,
    look_into,
)
from ros_scenesense.stages.learning_engine import LearningReport

_LONGEST_WORDS = 1000
_ALL_SCENES = 2**31


def changes_of_cycle(
    report: LearningReport, store: LearnerStore, given: Collection[str]
) -> Changes:
    """What a finished cycle changes.

    In each cycle all learned axioms lose strength, but for those that are pinned; what was learned
    again or used since the last one is reinforced; what is below the threshold is forgotten, and so
    is what labelled objects refute, however strong.

    Args:
        report: What was learned.
        store: The axioms of before.
        given: Ids that are taken by the domain.
    """
    cycle = store.cycle + 1
    before = store.axioms()
    again = {each.known: each for each in report.found if each.known is not None}
    lost = {each.axiom: each.words for each in report.lost}
    axioms: list[StoredAxiom] = []
    events: list[Event] = []
    for old in before:
        if old.state != "active":
            continue
        strength = old.strength if old.pinned else old.strength.step()
        what = "faded"
        if old.id in again or _is_used_well(old):
            strength = strength.reinforced()
            what = "learned again" if old.id in again else "used"
        new = replace(old, strength=strength)
        if old.id in again:
            found = again[old.id]
            new = replace(new, purity=found.purity, support=found.support)
        words = ""
        if old.id in report.refuted:
            new, what = replace(new, state="forgotten"), "refuted"
            words = report.refuted[old.id]
        elif old.id in lost:
            new, what, words = replace(new, state="merged"), "dropped in merging", lost[old.id]
        elif strength.value < FORGOTTEN_BELOW:
            new, what = replace(new, state="forgotten"), "forgotten"
        axioms.append(new)
        events.append(Event(cycle, old.id, what, strength.value, words))
    taken = {each.id for each in before} | set(given)
    for found in report.found:
        if found.known is None:
            fresh = _adopted(found.text, found.kind, found.purity, found.support, cycle, taken)
            taken.add(fresh.id)
            axioms.append(fresh)
            events.append(Event(cycle, fresh.id, "learned", 1.0, found.text))
    learned_before = {each.id for each in before}
    refuted = {name: words for name, words in report.refuted.items() if name not in learned_before}
    for each in report.lost:
        if each.given:
            refuted[each.axiom] = each.words
        elif each.axiom not in learned_before:
            # A new version that was not even adopted: its statement stands for it.
            events.append(Event(cycle, each.axiom, "not adopted", 0.0, each.words))
    events += [Event(cycle, name, "refuted", 0.0, words) for name, words in refuted.items()]
    events += [Event(cycle, name, "restored", 1.0, w) for name, w in report.restored.items()]
    words_fit = [replace(each, words=each.words[:_LONGEST_WORDS]) for each in events]
    restored = tuple(name for name in report.restored if name not in refuted)
    return Changes(axioms, words_fit, refuted, restored, tuple(report.changed))


def words_of_cycle(changes: Changes, problems: Sequence[str]) -> str:
    """What a cycle changed, and what could not be learned, in words."""
    what = Counter(event.what for event in changes.events)
    discarded = what["forgotten"] + what["dropped in merging"]
    said = [f"{what['learned']} axioms learned, {discarded} forgotten or merged"]
    said += [
        f"{each.axiom} {each.what}: {each.words}"
        for each in changes.events
        if each.what in ("refuted", "restored")
    ]
    said += [
        f"the world has changed: what {fluent!r} follows from is learned anew"
        for fluent in changes.changed
    ]
    return "; ".join([*said, *problems])


def answer_to(request: AxiomRequest, store: LearnerStore) -> tuple[Outcome, str, Changes | None]:
    """What becomes of a request: its outcome, the same in words, and what changes."""
    cycle, name = store.cycle, request.axiom
    if name in store.refuted():
        if request.request == "accept":
            event = Event(cycle, name, "accepted", 1.0, "in force again: a person said so")
            return "done", f"{name} is in force again", Changes((), (event,), {}, (name,))
        return "refused", f"{name} is given and refuted: only 'accept' is possible", None
    known = next((each for each in store.axioms() if each.id == name), None)
    if known is None:
        names = ", ".join(each.id for each in store.axioms("active")) or "none"
        return "refused", f"there is no learned axiom {name!r}; known: {names}", None
    match request.request:
        case "pin":
            if known.state != "active":
                return "refused", f"{name} is {known.state}: accept it first", None
            new, words = replace(known, pinned=True), f"{name} is pinned: it is not forgotten"
        case "veto":
            new = replace(known, state="vetoed", pinned=False)
            words = f"{name} is vetoed: it is out of force and will not be learned again"
        case "accept":
            new = replace(known, state="active", strength=Strength(known.strength.decay))
            words = f"{name} is in force at full strength"
    strength = new.strength.value if new.state == "active" else 0.0
    event = Event(cycle, name, _DONE[request.request], strength, "a person said so")
    return "done", words, Changes((new,), (event,))


def apply_request(path: Path, request: AxiomRequest, now_ns: int) -> tuple[Outcome, str]:
    """Does in a learner.db what a person asks, where no node runs that would do it.

    Raises:
        StateError: If there is none, or it cannot be used.
    """
    look_into(path)
    store = LearnerStore(path, Health(), _ALL_SCENES)
    try:
        outcome, reason, changes = answer_to(request, store)
        store.finish_request(request.id, outcome, reason, changes, now_ns)
    finally:
        store.close()
    return outcome, reason


def message_of(store: LearnerStore, now_ns: int) -> Axioms:
    """The learned axioms in force, and the given ones that are not."""
    return Axioms(
        stamp=Stamp.of(now_ns),
        revision=store.revision,
        cycle=store.cycle,
        axioms=[
            LearnedAxiom(
                id=each.id,
                text=each.text,
                kind=each.kind,
                strength=each.strength.value,
                support=each.support,
                purity=each.purity,
                age=store.cycle - each.born,
                pinned=each.pinned,
            )
            for each in store.axioms("active")
        ],
        refuted=list(store.refuted()),
    )


def progress_of(
    name: str, state: Literal["running", "done", "failed"], words: str, now_ns: int
) -> JobProgress:
    """How far a cycle has come."""
    return JobProgress(
        stamp=Stamp.of(now_ns),
        job_id=name,
        node="axiom_learner",
        state=state,
        progress=0.0 if state == "running" else 1.0,
        text=words[:4096],
    )


_DONE = {"pin": "pinned", "veto": "vetoed", "accept": "accepted"}


def _is_used_well(axiom: StoredAxiom) -> bool:
    """Whether it was used, and right as often as an axiom of its kind must be."""
    uses = axiom.right + axiom.wrong
    return uses > 0 and axiom.right >= TRUE_FROM[axiom.kind] * uses


def _adopted(
    text: str, kind: str, purity: float, support: float, cycle: int, taken: Collection[str]
) -> StoredAxiom:
    number = 1
    while (name := f"learned_{number}") in taken:
        number += 1
    return StoredAxiom(
        id=name,
        text=text,
        kind="default" if kind == "default" else "normal",
        state="active",
        strength=Strength(),
        support=support,
        purity=purity,
        born=cycle,
    )
