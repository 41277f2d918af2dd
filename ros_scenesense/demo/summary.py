"""The figures of a run, as `summary.json`. Every field is described in `docs/summary.md`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from ros_scenesense.demo.finals import FinalSummary, by_subject, share, summarise_finals
from ros_scenesense.demo.learning_curve import LearningSummary, summarise_learning
from ros_scenesense.demo.record import Decision, NodeRecord, RunRecord
from ros_scenesense.messages.reasoning import Knowledge
from ros_scenesense.nodes.registry import NODES
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import write_atomically
from ros_scenesense.scene import DecisionStatus

Outcome = Literal["complete", "timed_out", "interrupted", "failed"]


class _Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    pass


class TaskSummary(_Part, frozen=True):
    """What reasoning alone decided about one task: how, and how often physics agrees.

    `right`, `wrong`, `unjudged` are about the strict decisions, `default_*` about those by
    default. Shares are None where they would divide by zero.
    """

    strict: int
    by_default: int
    undecided: int
    inconsistent: int
    timed_out: int
    right: int
    wrong: int
    unjudged: int
    default_right: int
    default_wrong: int
    default_unjudged: int
    strict_accuracy: float | None
    default_accuracy: float | None
    strict_share: float | None
    decided_share: float | None

    @property
    def total(self) -> int:
        """All that there was to decide."""
        decided = self.strict + self.by_default
        return decided + self.undecided + self.inconsistent + self.timed_out


class Latency(_Part, frozen=True):
    """Median and 95th percentile of a duration, milliseconds."""

    count: int
    p50_ms: float
    p95_ms: float


class NodeSummary(_Part, frozen=True):
    """A node by its last heartbeat; `processes` is more than one if it was restarted."""

    ready: bool
    warm: bool
    processes: int
    counters: dict[str, int]


class KnowledgeSummary(_Part, frozen=True):
    """Which axioms were in force."""

    revision: str
    axioms: list[str]


class Summary(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    tag_field="schema",
    tag="run_summary/1",
):
    """Everything that `summary.json` holds."""

    session: str
    started: str
    command: str
    outcome: Outcome
    error: str | None
    seed: int
    arrangement: str
    domain_id: int
    asked: int
    scenes: int
    lost: int
    ready_s: float | None
    scenes_s: float | None
    scenes_per_s: float | None
    finals: dict[str, FinalSummary]
    tasks: dict[str, TaskSummary]
    end_to_end: Latency | None
    latency: dict[str, Latency]
    nodes: dict[str, NodeSummary]
    knowledge: KnowledgeSummary | None
    learning: LearningSummary | None = None
    versions: dict[str, str]
    machine: dict[str, str | int]


@dataclass(frozen=True)
class RunInfo:
    """What was asked for; the fields are those of `Summary`."""

    session: str
    started: str
    command: str
    seed: int
    arrangement: str
    domain_id: int
    asked: int


@dataclass(frozen=True)
class RunEnd:
    """How a run went, as the one who ran it measured it; the fields are those of `Summary`.

    `ready_s` is the time from the start of the launcher until all nodes were ready, `scenes_s`
    from then until the last scene was settled.
    """

    outcome: Outcome
    error: str | None = None
    ready_s: float | None = None
    scenes_s: float | None = None


def summarise(record: RunRecord, info: RunInfo, end: RunEnd) -> Summary:
    """The figures of a run."""
    settled = record.settled()
    lost = sum(scene.is_lost for scene in settled)
    scenes = len(settled) - lost
    latencies = [scene.latency_ms for scene in settled if scene.latency_ms is not None]
    knowledge = record.knowledge
    return Summary(
        session=info.session,
        started=info.started,
        command=info.command,
        outcome=end.outcome,
        error=end.error,
        seed=info.seed,
        arrangement=info.arrangement,
        domain_id=info.domain_id,
        asked=info.asked,
        scenes=scenes,
        lost=lost,
        ready_s=_rounded(end.ready_s),
        scenes_s=_rounded(end.scenes_s),
        scenes_per_s=_rounded(scenes / end.scenes_s if end.scenes_s else None),
        finals=summarise_finals(record.decisions()),
        tasks=summarise_tasks(record.decisions()),
        end_to_end=summarise_latency(latencies) if latencies else None,
        latency={
            name: summarise_latency(record.timings[name])
            for name in sorted(record.timings, key=graph_order)
        },
        nodes={name: _node(record.nodes[name]) for name in sorted(record.nodes, key=graph_order)},
        knowledge=None if knowledge is None else _knowledge(knowledge),
        learning=summarise_learning(record),
        versions=versions(),
        machine=machine(),
    )


def graph_order(name: str) -> tuple[int, str]:
    """Sorts names of nodes, and of what starts with one (`grounding/total`), as in the graph."""
    nodes, node = list(NODES), name.partition("/")[0]
    return (nodes.index(node) if node in nodes else len(nodes), name)


def summarise_tasks(decisions: Iterable[Decision]) -> dict[str, TaskSummary]:
    """Counts what reasoning decided, per subject; every subject is present."""
    grouped = by_subject(decisions).items()
    return {subject.value: summarise_task(found) for subject, found in grouped}


def summarise_task(decisions: Sequence[Decision]) -> TaskSummary:
    """Counts what reasoning decided, whatever it is about."""

    def count(status: DecisionStatus) -> int:
        return sum(decision.belief.status is status for decision in decisions)

    def judged(status: DecisionStatus, right: bool) -> int:
        return sum(
            decision.belief.status is status and decision.right is right for decision in decisions
        )

    strict, by_default = count(DecisionStatus.STRICT), count(DecisionStatus.BY_DEFAULT)
    right = judged(DecisionStatus.STRICT, True)
    wrong = judged(DecisionStatus.STRICT, False)
    default_right = judged(DecisionStatus.BY_DEFAULT, True)
    default_wrong = judged(DecisionStatus.BY_DEFAULT, False)
    return TaskSummary(
        strict=strict,
        by_default=by_default,
        undecided=count(DecisionStatus.UNDECIDED),
        inconsistent=count(DecisionStatus.INCONSISTENT),
        timed_out=count(DecisionStatus.TIMED_OUT),
        right=right,
        wrong=wrong,
        unjudged=strict - right - wrong,
        default_right=default_right,
        default_wrong=default_wrong,
        default_unjudged=by_default - default_right - default_wrong,
        strict_accuracy=share(right, right + wrong),
        default_accuracy=share(default_right, default_right + default_wrong),
        strict_share=share(strict, len(decisions)),
        decided_share=share(strict + by_default, len(decisions)),
    )


def summarise_latency(milliseconds: Sequence[float]) -> Latency:
    """Median and 95th percentile of at least one duration."""
    p50, p95 = np.percentile(milliseconds, [50.0, 95.0])
    return Latency(
        count=len(milliseconds), p50_ms=round(float(p50), 3), p95_ms=round(float(p95), 3)
    )


def write_summary(summary: Summary, path: Path) -> None:
    """Writes `summary.json`, indented."""
    write_atomically(path, msgspec.json.format(msgspec.json.encode(summary), indent=2) + b"\n")


def read_summary(path: Path) -> Summary:
    """Reads a `summary.json`.

    Raises:
        msgspec.ValidationError: If it does not follow the schema.
    """
    return msgspec.json.decode(path.read_bytes(), type=Summary)


def _node(node: NodeRecord) -> NodeSummary:
    beat = node.latest
    return NodeSummary(
        ready=beat.ready, warm=beat.warm, processes=node.processes, counters=beat.counters
    )


def _knowledge(knowledge: Knowledge) -> KnowledgeSummary:
    return KnowledgeSummary(
        revision=knowledge.revision, axioms=[axiom.id for axiom in knowledge.axioms]
    )


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
