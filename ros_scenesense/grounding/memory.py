"""What grounding has learned: the metric model and the viewpoint, taught by the same examples."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ros_scenesense.grounding.histograms import PairHistograms
from ros_scenesense.grounding.msr import MetricModel, MetricSettings, Source, converse
from ros_scenesense.grounding.viewpoint import ViewpointEstimator, ViewpointSettings
from ros_scenesense.scene import Distance, Position


@dataclass(frozen=True, eq=False)
class Example:
    """A pair whose relation somebody named.

    Attributes:
        relation: The object's, with respect to the reference.
        forward: What was seen of (object, reference).
        backward: What was seen of (reference, object).
        source: Who named it.
    """

    relation: Position | Distance
    forward: PairHistograms
    backward: PairHistograms
    source: Source


class GroundingMemory:
    """Learns from examples; gives the metric model, and the angle to turn the viewer's axes by.

    Attributes:
        model: The metric model, in the axes of people.
        viewpoint: Estimates how these are turned against the viewer's.
    """

    def __init__(
        self,
        metric: MetricSettings | None = None,
        viewpoint: ViewpointSettings | None = None,
    ) -> None:
        self.model = MetricModel(metric)
        self.viewpoint = ViewpointEstimator(viewpoint)

    @property
    def yaw_rad(self) -> float:
        """By how much the viewer's axes must be turned to the left to be those of people."""
        return self.viewpoint.yaw_rad

    def expect_change(self) -> None:
        """The camera is known to have moved: what people say next may be named along other axes."""
        self.viewpoint.expect_change()

    def learn(self, examples: Iterable[Example], agreement_dropped: bool = False) -> None:
        """Merges examples.

        Args:
            examples: In the order in which they were named.
            agreement_dropped: Whether control finds that people suddenly disagree. If no other
                angle explains it, what was learned before fades behind these examples.
        """
        taken = list(examples)
        turned = False
        for example in taken:
            seen, relation = example.forward, example.relation
            is_word = example.source is Source.HUMAN and seen.is_level
            if is_word and isinstance(relation, Position):
                turned |= self.viewpoint.observe(relation, seen.azimuth_rad + seen.yaw_rad)
        if agreement_dropped and not turned:
            self.model.fade()
        for example in taken:
            forward, backward = (
                one.along(self.yaw_rad) for one in (example.forward, example.backward)
            )
            self.model.learn(example.relation, forward, example.source)
            other = converse(example.relation)
            if other is not None:
                self.model.learn(other, backward, example.source)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """All that was learned, as plain arrays: for a file."""
        return self.model.to_arrays() | self.viewpoint.to_arrays()

    @classmethod
    def from_arrays(
        cls,
        arrays: Mapping[str, np.ndarray],
        metric: MetricSettings | None = None,
        viewpoint: ViewpointSettings | None = None,
    ) -> GroundingMemory:
        """The memory that `to_arrays` described.

        Raises:
            ValueError: If an array is missing or wrong.
        """
        memory = cls()
        memory.model = MetricModel.from_arrays(arrays, metric)
        memory.viewpoint = ViewpointEstimator.from_arrays(arrays, viewpoint)
        return memory
