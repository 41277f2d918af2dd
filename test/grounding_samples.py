"""Scenes of pairs for the tests of control and of what grounding remembers."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ros_scenesense.grounding.histograms import (
    DISTANCE_BINS,
    PHI_BINS,
    POSITION_BINS,
    SceneHistograms,
)
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import (
    Feedback,
    Grounding,
    Groundings,
    MsrSample,
    MsrUpdate,
    PairGrounding,
)
from ros_scenesense.scene import Distance, NamingFrame, Position
from ros_scenesense.stages.scene_records import SceneRecord

NAMES = ("a", "b", "c")


def said(position: Position, distance: Distance = Distance.NOT_TOUCHING) -> Grounding:
    return Grounding(
        position=position, position_confidence=0.9, distance=distance, distance_confidence=0.9
    )


def groundings(
    scene_id: str = "s-0",
    *,
    names: tuple[str, ...] = NAMES,
    qsr: Position = Position.LEFT,
    msr: Position | None = Position.RIGHT,
    applied_update: int = 0,
) -> Groundings:
    """Both models name one relation for every pair in the order of the names."""
    pairs = []
    for first, second in itertools.combinations(names, 2):
        pairs.append(_pair(first, second, qsr, msr))
        pairs.append(_pair(second, first, qsr.converse, msr and msr.converse))
    return Groundings(
        stamp=Stamp.of(42),
        scene_id=scene_id,
        naming_frame=NamingFrame.VIEWER,
        pairs=pairs,
        applied_update=applied_update,
    )


def _pair(first: str, second: str, qsr: Position | None, msr: Position | None) -> PairGrounding:
    return PairGrounding(
        object=first, reference=second, qsr=qsr and said(qsr), msr=msr and said(msr)
    )


def feedback(words: str, scene_id: str | None = None, id: str = "") -> Feedback:
    """Feedback from words like `left a b`."""
    relation, object, reference = words.split()
    return Feedback(relation=relation, object=object, reference=reference, scene_id=scene_id, id=id)


def sample(words: str, scene_id: str = "s-0", source: str = "human") -> MsrSample:
    """A sample from words like `left a b`."""
    relation, object, reference = words.split()
    return MsrSample(
        scene_id=scene_id, object=object, reference=reference, relation=relation, source=source
    )


def update(number: int, *samples: MsrSample, first_pending: int = 1, **values) -> MsrUpdate:
    return MsrUpdate(
        stamp=Stamp.of(number),
        id=number,
        first_pending=first_pending,
        samples=list(samples),
        **values,
    )


def record(
    scene_id: str = "s-0",
    *,
    names: tuple[str, ...] = NAMES,
    azimuth_rad: float = math.pi,
    bin_m: int = 20,
) -> SceneRecord:
    """A scene in which every object stands in one direction of those after it: left, if not told.

    All its points lie in one bin of the angles, and all distances in one bin.
    """
    count = len(names)
    position = np.zeros((count, count, POSITION_BINS))
    distance = np.zeros((count, count, DISTANCE_BINS))
    azimuths = np.zeros((count, count))
    for i, j in itertools.permutations(range(count), 2):
        azimuth = azimuth_rad if i < j else azimuth_rad - math.pi
        phi = int((math.remainder(azimuth, 2 * math.pi) / (2 * math.pi) + 0.5) * PHI_BINS)
        position[i, j, 6 * PHI_BINS + min(phi, PHI_BINS - 1)] = 1.0
        distance[i, j, bin_m] = 1.0
        azimuths[i, j] = math.remainder(azimuth, 2 * math.pi)
    return SceneRecord.of(scene_id, names, SceneHistograms(position, distance, azimuths))
