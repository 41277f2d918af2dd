"""Runs the stages of the graph on one frame: what this finds, the nodes would find too."""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import FrameError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Objects, PerceivedObject, Relation, Relations
from ros_scenesense.messages.reasoning import (
    Beliefs,
    DerivedRelation,
    ObjectBelief,
    StructureBelief,
)
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.scene import Frame, NamingFrame
from ros_scenesense.stages.grounding import GroundingStage
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.grounding_engine import GIVEN, OWN, GroundingConfiguration
from ros_scenesense.stages.protocol import Outgoing, Segmentation, Timing
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage

SCENE_ID = "frame-0000"
_FATAL = ("empty_depth", "depth_units", "grounding_failed", "scene_refused")


class Report(msgspec.Struct, frozen=True, kw_only=True, tag_field="schema", tag="perceived/1"):
    """What was found in a frame, as JSON.

    Attributes:
        width: Of the images in pixels.
        height: Of the images in pixels.
        readings: Share of the pixels with a depth reading.
        naming_frame: Of the relations.
        objects: The objects with their attributes; boxes in the camera's optical frame.
        relations: One position and one distance relation per pair.
        derived: What axioms conclude about relations, e.g. *on*.
        decisions: Of every object: stable, occluded, how it is known and by which axioms.
        structures: The stacks and their stability.
        problems: What was wrong, in words.
        timings_ms: Milliseconds of every step.
    """

    width: int
    height: int
    readings: float
    naming_frame: NamingFrame
    objects: list[PerceivedObject]
    relations: list[Relation]
    derived: list[DerivedRelation]
    decisions: list[ObjectBelief]
    structures: list[StructureBelief]
    problems: list[str]
    timings_ms: dict[str, float]


@dataclass(frozen=True, eq=False)
class Perceived:
    """A report, and the instance ids (H, W) that it speaks of."""

    report: Report
    instances: npt.NDArray[np.uint16]


def perceive(frame: Frame) -> Perceived:
    """Finds the objects of a frame, their relations, and what follows from them.

    Args:
        frame: With instance ids, or without: then the objects are told apart here.

    Raises:
        FrameError: If nothing can be located in it: no reading, wrong units, no table.
    """
    instances = OWN if frame.instances is None else GIVEN
    stages = (
        GroundingStage(GroundingConfiguration(instances=instances)),
        GroundingControlStage(GroundingControlConfiguration()),
        ReasonerStage(ReasonerConfiguration()),
    )
    pipeline = Pipeline(stages, clock=lambda: frame.stamp_ns)
    stamp = Stamp.of(frame.stamp_ns)
    pipeline.put(Scene(stamp=stamp, scene_id=SCENE_ID, mode="testing", objects=[]))
    pipeline.put(frame)
    try:
        published = list(pipeline.run())
    finally:
        pipeline.close()
    problems = [problem for stage in stages for problem in stage.health.take_problems()]
    for kind, words in problems:
        if kind in _FATAL:
            raise FrameError(words.replace(f"scene {SCENE_ID}", "the frame"))
    return _perceived(frame, published, [words for _, words in problems])


def _perceived(frame: Frame, published: list[Outgoing], problems: list[str]) -> Perceived:
    (objects,) = (item for item in published if isinstance(item, Objects))
    (relations,) = (item for item in published if isinstance(item, Relations))
    (beliefs,) = (item for item in published if isinstance(item, Beliefs))
    (segmentation,) = (item for item in published if isinstance(item, Segmentation))
    readings = np.isfinite(frame.depth) & (frame.depth > 0.0)
    report = Report(
        width=frame.intrinsics.width,
        height=frame.intrinsics.height,
        readings=round(float(np.mean(readings)), 4),
        naming_frame=relations.naming_frame,
        objects=objects.objects,
        relations=relations.relations,
        derived=beliefs.derived,
        decisions=beliefs.objects,
        structures=beliefs.structures,
        problems=problems,
        timings_ms={
            item.name: round(item.milliseconds, 2) for item in published if isinstance(item, Timing)
        },
    )
    return Perceived(report, segmentation.instances)


def distance_m(one: PerceivedObject) -> float | None:
    """How far the centre of an object's box is from the camera; None if it is not located."""
    return None if one.box is None else math.hypot(*one.box.pose.position)
