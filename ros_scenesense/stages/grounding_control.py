"""Control as a stage: which grounding is trusted, and the relations that the reasoner gets."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec

from ros_scenesense.grounding.control import ARBITER, SWITCH, Control
from ros_scenesense.grounding.trust import TrustSettings
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Groundings, PairGrounding, Relations, Trust
from ros_scenesense.parameters import parameter
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import Incoming, Job, Outgoing, Timing

_REMEMBERED = 2000


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


class GroundingControlStage:
    """Turns each scene's groundings into relations, by the more trusted model.

    Attributes:
        control: Chooses between the groundings.
        trust: The trust in the models, as published at the start.
    """

    def __init__(self, configuration: GroundingControlConfiguration) -> None:
        self.configuration = configuration
        self.health = Health()
        self.control = Control(
            configuration.mode,
            TrustSettings(qsr=configuration.trust_qsr, msr=configuration.trust_msr),
        )
        self.trust = Trust(
            stamp=Stamp.of(0),
            revision=0,
            qsr=configuration.trust_qsr,
            msr=configuration.trust_msr,
            feedback_count=0,
        )
        self._settled: OrderedDict[str, None] = OrderedDict()

    def engine(self) -> Callable[[], Any] | None:
        """There are no jobs."""
        return None

    def start(self, now_ns: int) -> list[Outgoing]:
        """Publishes the trust."""
        self.trust = msgspec.structs.replace(self.trust, stamp=Stamp.of(now_ns))
        return [self.trust]

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes `groundings`; the first of a scene counts."""
        del now_ns
        if not isinstance(item, Groundings):
            return []
        if item.scene_id in self._settled:
            self.health.count("repeated")
            return []
        self._settled[item.scene_id] = None
        while len(self._settled) > _REMEMBERED:
            self._settled.popitem(last=False)
        return self._relations(item)

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Nothing waits."""
        del now_ns
        return []

    def jobs(self) -> list[Job]:
        """There are none."""
        return []

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """There are no jobs to finish."""
        del job, result, now_ns
        return []

    def close(self) -> None:
        """Holds no files."""

    def _relations(self, groundings: Groundings) -> list[Outgoing]:
        start = time.perf_counter()
        settled = self.control.settle(self._proper_pairs(groundings))
        self.health.count("scenes_settled")
        self.health.count("disagreements", settled.disagreements)
        relations = Relations(
            stamp=groundings.stamp,
            scene_id=groundings.scene_id,
            naming_frame=groundings.naming_frame,
            relations=settled.relations,
            disagreements=settled.disagreements,
            trust_qsr=self.trust.qsr,
            trust_msr=self.trust.msr,
            trust_revision=self.trust.revision,
        )
        elapsed_ms = (time.perf_counter() - start) * 1e3
        return [relations, Timing("grounding_control/control", elapsed_ms)]

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
