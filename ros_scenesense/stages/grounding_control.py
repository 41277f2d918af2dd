"""Control as a stage: which grounding is trusted, and the relations that the reasoner gets."""

from __future__ import annotations

import sqlite3
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec

from ros_scenesense.errors import MessageError
from ros_scenesense.grounding.control import ARBITER, SWITCH, Control
from ros_scenesense.grounding.trust import Kind, TrustSettings
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import (
    Feedback,
    Groundings,
    PairGrounding,
    Relation,
    Relations,
    Trust,
)
from ros_scenesense.parameters import parameter
from ros_scenesense.stages.control_ledger import ControlLedger
from ros_scenesense.stages.evidence import Outbox, evidence_of
from ros_scenesense.stages.feedback_desk import FeedbackDesk
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import Figure, Incoming, Job, Outgoing, Timing
from ros_scenesense.stages.state_file import state_path

_REMEMBERED = 2000
_RECENT = 20


@dataclass(frozen=True)
class GroundingControlConfiguration:
    """Parameters of the control node."""

    mode: str = parameter(
        ARBITER,
        "switch: the grounding that is trusted more names all relations, as in the paper; arbiter: "
        "trust is one per kind of relation, and how sure a grounding is counts too",
        choices=(ARBITER, SWITCH),
    )
    trust_qsr: float = parameter(
        0.9, "trust in the qualitative grounding before any feedback", minimum=0.0, maximum=1.0
    )
    trust_msr: float = parameter(
        0.1, "trust in the metric grounding before any feedback", minimum=0.0, maximum=1.0
    )
    evidence_confidence: float = parameter(
        0.6,
        "relations of a scene that are at least so sure are evidence for the metric grounding",
        minimum=0.0,
        maximum=1.0,
    )
    remembered_scenes: int = parameter(200, "scenes that feedback may still be about", minimum=1)
    resend_s: float = parameter(
        2.0,
        "seconds after which evidence that is not known to be applied is sent again, then twice as "
        "many, up to a minute",
        minimum=0.1,
    )
    state_dir: str = parameter("", "folder of control.db; empty = nothing is remembered")


class GroundingControlStage:
    """Turns each scene's groundings into relations, by the more trusted model.

    Attributes:
        control: Chooses between the groundings.

    Raises:
        StateError: If control.db cannot be used.
    """

    def __init__(self, configuration: GroundingControlConfiguration) -> None:
        self.configuration = configuration
        self.health = Health()
        self.control = Control(
            configuration.mode,
            TrustSettings(qsr=configuration.trust_qsr, msr=configuration.trust_msr),
        )
        self._ledger = ControlLedger(
            state_path(configuration.state_dir, "control.db"),
            self.health,
            configuration.remembered_scenes,
        )
        self._desk = FeedbackDesk(self._ledger, self.control, self.health)
        self._outbox = Outbox(self._ledger, configuration.resend_s)
        self._settled: OrderedDict[str, None] = OrderedDict()

    def engine(self) -> Callable[[], Any] | None:
        """There are no jobs."""
        return None

    def start(self, now_ns: int) -> list[Outgoing]:
        """Publishes the trust, and the evidence that may not have arrived before."""
        trust = msgspec.structs.replace(self._desk.trust, stamp=Stamp.of(now_ns))
        return [trust, *self._figures(trust), *self._outbox.news(now_ns)]

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes `groundings`, of which the first of a scene counts, and `feedback`."""
        if isinstance(item, Feedback):
            return self._take(item, now_ns)
        if not isinstance(item, Groundings):
            return []
        self._outbox.applied(item.applied_update)
        if item.scene_id in self._settled:
            self.health.count("repeated")
            return []
        self._settled[item.scene_id] = None
        while len(self._settled) > _REMEMBERED:
            self._settled.popitem(last=False)
        if self._ledger.knows(item.scene_id):
            return self._again(item.scene_id)
        return [*self._relations(item), *self._outbox.news(now_ns)]

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Sends again what is not known to be applied."""
        return [*self._outbox.due(now_ns)]

    def jobs(self) -> list[Job]:
        """There are none."""
        return []

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """There are no jobs to finish."""
        del job, result, now_ns
        return []

    def close(self) -> None:
        """Closes control.db."""
        self._ledger.close()

    def _take(self, feedback: Feedback, now_ns: int) -> list[Outgoing]:
        result = self._desk.take(feedback, now_ns)
        if result.outcome != "accepted":
            return [result]
        trust = self._desk.trust
        return [result, trust, *self._figures(trust), *self._outbox.news(now_ns)]

    def _again(self, scene_id: str) -> list[Outgoing]:
        """What was published of a scene before a restart."""
        self.health.count("repeated")
        relations = self._ledger.relations(scene_id)
        return [] if relations is None else [relations]

    def _relations(self, groundings: Groundings) -> list[Outgoing]:
        start = time.perf_counter()
        pairs = self._proper_pairs(groundings)
        settled = self.control.settle(pairs)
        self.health.count("scenes_settled")
        self.health.count("disagreements", settled.disagreements)
        relations = Relations(
            stamp=groundings.stamp,
            scene_id=groundings.scene_id,
            naming_frame=groundings.naming_frame,
            relations=_as_viewed(settled.relations, pairs),
            disagreements=settled.disagreements,
            trust_qsr=self._desk.trust.qsr,
            trust_msr=self._desk.trust.msr,
            trust_revision=self._desk.trust.revision,
        )
        evidence = evidence_of(relations, self.configuration.evidence_confidence)
        try:
            self._ledger.record_scene(groundings, relations, evidence)
        except (sqlite3.Error, MessageError) as error:
            words = f"scene {groundings.scene_id} could not be written to control.db: {error}"
            self.health.problem("not_remembered", words)
        elapsed_ms = (time.perf_counter() - start) * 1e3
        published: list[Outgoing] = [relations, Timing("grounding_control/control", elapsed_ms)]
        both = [(pair.qsr, pair.msr) for pair in pairs if pair.qsr and pair.msr]
        if both:
            alike = sum(qsr.position is msr.position for qsr, msr in both)
            published.append(Figure("grounding_control/models_agree", alike / len(both)))
        return published

    def _figures(self, trust: Trust) -> list[Figure]:
        """What people may plot of the trust."""
        values = {"trust_qsr": trust.qsr, "trust_msr": trust.msr}
        for one in trust.kinds:
            values |= {f"trust_qsr_{one.kind}": one.qsr, f"trust_msr_{one.kind}": one.msr}
        agreement, count = self._ledger.recent_agreement(_RECENT)
        if count:
            values["recent_agreement"] = agreement
        values["viewpoint_changes"] = float(self.control.state.viewpoint)
        return [Figure(f"grounding_control/{name}", value) for name, value in values.items()]

    def _proper_pairs(self, groundings: Groundings) -> list[PairGrounding]:
        """The pairs, less repeated ones and those of an object with itself."""
        pairs: dict[tuple[str, str], PairGrounding] = {}
        bad = []
        for pair in groundings.pairs:
            key = (pair.object, pair.reference)
            if pair.object == pair.reference or key in pairs:
                bad.append(f"{pair.object} and {pair.reference}")
            else:
                pairs[key] = pair
        if bad:
            self.health.problem(
                "pairs_refused",
                f"groundings of scene {groundings.scene_id} pair an object with itself, or the "
                f"same objects twice ({len(bad)} pairs, first {bad[0]}): these are ignored",
            )
        return list(pairs.values())


def _as_viewed(relations: list[Relation], pairs: list[PairGrounding]) -> list[Relation]:
    """The relations with what a viewer would call their directions, where that is known."""
    said = {(one.object, one.reference): one.viewer_position for one in pairs}
    seen = []
    for one in relations:
        viewed = said.get((one.object, one.reference))
        both = {Kind.of(position) for position in (one.position, viewed) if position is not None}
        if viewed is not None and both == {Kind.HORIZONTAL}:
            one = msgspec.structs.replace(one, viewer_position=viewed)
        seen.append(one)
    return seen
