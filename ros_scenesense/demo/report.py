"""The report of a run: one HTML file that needs nothing else, not even a network.

This module says what the page shows; `report.html.j2` says how it looks. The template engine
escapes every text, for names of objects come from outside.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ros_scenesense.demo.cards import make_card
from ros_scenesense.demo.finals import DECIDERS, summarise_final
from ros_scenesense.demo.overlay import FONT_SIZE
from ros_scenesense.demo.record import MAX_FRAMES, Decision, RunRecord, Subject
from ros_scenesense.demo.summary import Latency, Summary, summarise_task
from ros_scenesense.demo.templates import template
from ros_scenesense.results import write_atomically

SUBJECT_TITLES = {
    Subject.STABILITY: "Object is stable",
    Subject.OCCLUSION: "Object is occluded",
    Subject.STRUCTURE_STABILITY: "Structure is stable",
    Subject.STACK_STABILITY: "… of which real stacks",
}


@dataclass(frozen=True)
class Bar:
    """A stage in the latency chart; the widths are per cent of the chart."""

    name: str
    latency: Latency
    p50_width: float
    p95_width: float


@dataclass(frozen=True)
class AxiomUse:
    """An axiom with how often decisions rested on it, and how often physics agreed."""

    id: str
    kind: str
    text: str
    origin: str
    used: int
    right: int
    wrong: int


def write_report(record: RunRecord, summary: Summary, path: Path) -> None:
    """Writes `report.html`."""
    write_atomically(path, render(record, summary).encode())


def render(record: RunRecord, summary: Summary) -> str:
    """The report as HTML text."""
    settled = record.settled()
    context: dict[str, Any] = {
        "summary": summary,
        "headline": summarise_final(_about_objects(record)),
        "strict": summarise_task(_about_objects(record)),
        "deciders": DECIDERS,
        "finals": [(SUBJECT_TITLES[Subject(key)], final) for key, final in summary.finals.items()],
        "tasks": [(SUBJECT_TITLES[Subject(key)], task) for key, task in summary.tasks.items()],
        "cards": [make_card(scene, record) for scene in settled[:MAX_FRAMES]],
        "left_out": max(0, len(settled) - MAX_FRAMES),
        "bars": _bars(summary),
        "axioms": _axiom_uses(record),
        "font_size": FONT_SIZE,
        "learned_cycles": _learned_cycles(summary),
    }
    return template("report.html.j2").render(context)


def _learned_cycles(summary: Summary) -> list[int]:
    if summary.learning is None:
        return []
    return [each.cycle for each in summary.learning.cycles if each.cycle]


def _bars(summary: Summary) -> list[Bar]:
    latencies = dict(summary.latency)
    if summary.end_to_end is not None:
        latencies = {"frame to decision": summary.end_to_end, **latencies}
    longest = max((latency.p95_ms for latency in latencies.values()), default=0.0)
    scale = 100.0 / longest if longest else 0.0
    return [
        Bar(name, latency, round(latency.p50_ms * scale, 2), round(latency.p95_ms * scale, 2))
        for name, latency in latencies.items()
    ]


def _about_objects(record: RunRecord) -> list[Decision]:
    # A structure's decision rests on those of its members: it would count them twice.
    tasks = (Subject.STABILITY, Subject.OCCLUSION)
    return [decision for decision in record.decisions() if decision.subject in tasks]


def _axiom_uses(record: RunRecord) -> list[AxiomUse]:
    if record.knowledge is None:
        return []
    uses: dict[str, Counter[bool | None]] = {}
    for decision in _about_objects(record):
        for axiom in decision.belief.axioms:
            uses.setdefault(axiom, Counter())[decision.right] += 1
    return [
        AxiomUse(
            id=axiom.id,
            kind=axiom.kind,
            text=axiom.text,
            origin=axiom.origin,
            used=uses.get(axiom.id, Counter()).total(),
            right=uses.get(axiom.id, Counter())[True],
            wrong=uses.get(axiom.id, Counter())[False],
        )
        for axiom in record.knowledge.axioms
    ]
