"""The image `annotated_image`: regions of interest and final decisions, for people to see."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from ros_scenesense.demo.annotation import Color, Note, Rectangle, annotate, surely
from ros_scenesense.messages.attention import Estimate, Estimates, Roi, Rois
from ros_scenesense.messages.grounding import Objects
from ros_scenesense.scene import Frame, Task
from ros_scenesense.stages.join import SceneJoin
from ros_scenesense.stages.protocol import Segmentation

_PARTS: dict[type[Any], str] = {
    Frame: "frame",
    Segmentation: "segmentation",
    Objects: "objects",
    Rois: "rois",
    Estimates: "estimates",
}
_STABLE: dict[bool | None, Color] = {True: (0, 130, 0), False: (205, 0, 0), None: (90, 90, 90)}
_REGION: dict[Task, Color] = {Task.STABILITY: (255, 140, 0), Task.OCCLUSION: (30, 110, 255)}


class AnnotatedImages:
    """Collects what belongs to a scene until it can be drawn; nothing while nobody looks.

    Attributes:
        wanted: Whether somebody looks.
    """

    def __init__(self) -> None:
        self.wanted = False
        self._parts = SceneJoin(tuple(_PARTS.values()), timeout_s=20.0, capacity=8)

    def add(self, item: Any, now_ns: int) -> tuple[Frame, npt.NDArray[np.uint8]] | None:
        """Takes a part of a scene; returns the frame and the picture once it is complete."""
        part = _PARTS.get(type(item))
        if part is None or not self.wanted:
            return None
        stamped = (
            item.stamp_ns if isinstance(item, Frame | Segmentation) else item.stamp.nanoseconds
        )
        parts = self._parts.add(stamped, part, item, now_ns)
        if parts is None:
            return None
        objects, estimates = parts["objects"], parts["estimates"]
        rois, instances = parts["rois"].rois, parts["segmentation"].instances
        return parts["frame"], draw(parts["frame"].color, instances, objects, rois, estimates)

    def expire(self, now_ns: int) -> None:
        """Forgets the scenes that stayed incomplete; called regularly."""
        self._parts.expired(now_ns)


def draw(
    color: npt.NDArray[np.uint8],
    instances: npt.NDArray[np.uint16],
    objects: Objects,
    rois: Iterable[Roi],
    estimates: Estimates,
) -> npt.NDArray[np.uint8]:
    """The image (s H, s W, 3) RGB with outlines by stability, decisions in words, and regions.

    Regions about stability are orange, those about occlusion blue.
    """
    decided = {each.name: each for each in estimates.objects}
    notes = []
    for one in objects.objects:
        about = decided.get(one.name)
        if about is None:
            continue
        words = ", ".join(
            [
                one.name,
                _said(about.stable, "stable", "unstable"),
                _said(about.occluded, "occluded", "visible"),
            ]
        )
        notes.append(Note(one.instance, words, _STABLE[about.stable.value]))
    regions = [
        Rectangle(roi.left, roi.top, roi.width, roi.height, _REGION[roi.task]) for roi in rois
    ]
    return annotate(color, instances, notes, regions)


def _said(estimate: Estimate, positive: str, negative: str) -> str:
    if estimate.value is None:
        return f"{positive}?"
    said = positive if estimate.value else negative
    if estimate.source != "network" or estimate.probability is None:
        return said
    return f"{said} {surely(estimate.probability)}"
