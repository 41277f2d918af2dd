"""What control tells the metric model: which evidence a scene gives, and how it gets there."""

from __future__ import annotations

from ros_scenesense.messages.grounding import MsrSample, MsrUpdate, Relations
from ros_scenesense.stages.control_ledger import ControlLedger
from ros_scenesense.stages.statements import name_of

# With the longest names and ids an update stays below the size limit of its topic.
_SAMPLES_PER_UPDATE = 140
_SENT_AT_ONCE = 100
_SLOWEST_S = 60.0


def evidence_of(relations: Relations, least_confidence: float) -> list[list[MsrSample]]:
    """The relations of a scene as samples, in groups that fit an update each.

    Paper, section *Metric Spatial Representation*: once relations are determined in a new scene,
    by whichever grounding, the learned histograms are updated with them.

    Args:
        relations: What was settled on.
        least_confidence: A relation that is less sure teaches nothing.
    """
    samples = []
    for one in relations.relations:
        for relation, confidence, source in (
            (one.position, one.position_confidence, one.position_source),
            (one.distance, one.distance_confidence, one.distance_source),
        ):
            if confidence >= least_confidence:
                samples.append(
                    MsrSample(
                        scene_id=relations.scene_id,
                        object=one.object,
                        reference=one.reference,
                        relation=name_of(relation),
                        source=source,
                    )
                )
    starts = range(0, len(samples), _SAMPLES_PER_UPDATE)
    return [samples[start : start + _SAMPLES_PER_UPDATE] for start in starts]


class Outbox:
    """Sends every update once it is written, and again until it is known to be applied.

    Grounding says in `groundings` what it has applied. While no scene comes, it says nothing, so
    the time between two attempts grows.

    Args:
        ledger: Holds the updates.
        resend_s: Seconds until the first repetition.
    """

    def __init__(self, ledger: ControlLedger, resend_s: float) -> None:
        self._ledger = ledger
        self._resend_s = resend_s
        self._wait_s = resend_s
        self._sent = 0
        self._sent_ns = 0

    def news(self, now_ns: int) -> list[MsrUpdate]:
        """The updates that were not sent yet."""
        updates = self._ledger.pending(after=self._sent, limit=_SENT_AT_ONCE)
        if updates:
            self._sent, self._sent_ns, self._wait_s = updates[-1].id, now_ns, self._resend_s
        return updates

    def due(self, now_ns: int) -> list[MsrUpdate]:
        """The updates that are to be sent again now, and what was too much for one time."""
        if now_ns - self._sent_ns <= self._wait_s * 1e9:
            return []
        self._sent_ns = now_ns
        self._wait_s = min(2.0 * self._wait_s, _SLOWEST_S)
        updates = self._ledger.pending(limit=_SENT_AT_ONCE)
        if updates:
            self._sent = max(self._sent, updates[-1].id)
        return updates

    def applied(self, last: int) -> None:
        """Grounding has applied all updates up to this one."""
        self._ledger.applied(last)
