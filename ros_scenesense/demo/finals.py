"""Who decided in the end, and how often physics agrees. Described in `docs/summary.md`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import msgspec

from ros_scenesense.demo.record import Decision, Subject
from ros_scenesense.scene import Truth

DECIDERS = ("reasoning", "default", "network")
"""The sources that decide; what none of them decides has the source `none`."""


class SourceSummary(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What one source decided; unjudged where the label is ambiguous or missing."""

    right: int
    wrong: int
    unjudged: int

    @property
    def total(self) -> int:
        """All that this source decided."""
        return self.right + self.wrong + self.unjudged


class FinalSummary(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The final decisions about one task, beside what reasoning alone decided.

    Attributes:
        by_source: Counts per source that decides.
        undecided: What nobody decided: source `none`.
        accuracy: Share of right ones among the final decisions that can be judged.
        decided_share: Share that was decided by anybody.
        right_share: Share of right ones among all that has a clear label, decided or not.
        reasoning_accuracy, reasoning_decided_share, reasoning_right_share: The same of reasoning
            alone.
    """

    by_source: dict[str, SourceSummary]
    undecided: int
    accuracy: float | None
    decided_share: float | None
    right_share: float | None
    reasoning_accuracy: float | None
    reasoning_decided_share: float | None
    reasoning_right_share: float | None

    @property
    def total(self) -> int:
        """All that there was to decide."""
        return self.undecided + sum(source.total for source in self.by_source.values())

    @property
    def right(self) -> int:
        """Final decisions that physics confirms."""
        return sum(source.right for source in self.by_source.values())

    @property
    def judged(self) -> int:
        """Final decisions that can be held against a clear label."""
        return self.right + sum(source.wrong for source in self.by_source.values())


def summarise_finals(decisions: Iterable[Decision]) -> dict[str, FinalSummary]:
    """Counts the final decisions per subject; every subject is present."""
    grouped = by_subject(decisions).items()
    return {subject.value: summarise_final(found) for subject, found in grouped}


def by_subject(decisions: Iterable[Decision]) -> dict[Subject, list[Decision]]:
    """The decisions per subject; every subject is present."""
    grouped: dict[Subject, list[Decision]] = {subject: [] for subject in Subject}
    for decision in decisions:
        grouped[decision.subject].append(decision)
    return grouped


def summarise_final(decisions: Sequence[Decision]) -> FinalSummary:
    """Counts the final decisions, whatever they are about."""
    by_source = {
        source: _counts([each for each in decisions if each.estimate.source == source])
        for source in DECIDERS
    }
    final = [each.final_right for each in decisions if each.final_right is not None]
    reasoned = [each.right for each in decisions if each.right is not None]
    clear = sum(each.label in (Truth.TRUE, Truth.FALSE) for each in decisions)
    decided = sum(source.total for source in by_source.values())
    return FinalSummary(
        by_source=by_source,
        undecided=len(decisions) - decided,
        accuracy=share(sum(final), len(final)),
        decided_share=share(decided, len(decisions)),
        right_share=share(sum(final), clear),
        reasoning_accuracy=share(sum(reasoned), len(reasoned)),
        reasoning_decided_share=share(sum(each.decided for each in decisions), len(decisions)),
        reasoning_right_share=share(sum(reasoned), clear),
    )


def share(part: int, whole: int) -> float | None:
    """A share to four places, None of nothing."""
    return round(part / whole, 4) if whole else None


def _counts(decisions: Sequence[Decision]) -> SourceSummary:
    right = sum(each.final_right is True for each in decisions)
    wrong = sum(each.final_right is False for each in decisions)
    return SourceSummary(right=right, wrong=wrong, unjudged=len(decisions) - right - wrong)
