"""Regions of interest: the parts of an image that hold what reasoning could not decide.

Paper, section *Attention Mechanism and Deep Learning* and its figure of two regions: objects that
stand in a relevant relation belong together; the smallest rectangle around those that belong to an
object in question is looked at, the rest of the image is not.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.relevance import Relevance
from ros_scenesense.messages.attention import Roi
from ros_scenesense.messages.grounding import Relation

Pixel = TypeVar("Pixel", bound=np.generic)

MOST_OBJECTS = 5
"""Objects in a region at most (paper, *Experimental Setup*)."""
MARGIN = 0.05
"""Margin around the objects of a region, as a share of its longer side."""


@dataclass(frozen=True)
class Rectangle:
    """A part of an image, in pixels: columns `left` to `right` - 1, rows `top` to `bottom` - 1."""

    left: int
    top: int
    right: int
    bottom: int

    def union(self, other: Rectangle) -> Rectangle:
        """The smallest rectangle that holds both."""
        return Rectangle(
            min(self.left, other.left),
            min(self.top, other.top),
            max(self.right, other.right),
            max(self.bottom, other.bottom),
        )

    def grown(self, margin: int, width: int, height: int) -> Rectangle:
        """With a margin in pixels on every side, as far as the image reaches."""
        return Rectangle(
            max(0, self.left - margin),
            max(0, self.top - margin),
            min(width, self.right + margin),
            min(height, self.bottom + margin),
        )

    def gap(self, other: Rectangle) -> float:
        """Pixels between two rectangles; 0 where they touch or overlap."""
        across = max(0, self.left - other.right, other.left - self.right)
        down = max(0, self.top - other.bottom, other.top - self.bottom)
        return float(np.hypot(across, down))


def rectangles(instances: npt.NDArray[np.uint16]) -> dict[int, Rectangle]:
    """The smallest rectangle around the pixels of every instance id but 0 (the background).

    Args:
        instances: (H, W) instance ids.
    """
    from scipy.ndimage import find_objects

    found = enumerate(find_objects(instances.astype(np.int32)), start=1)
    return {
        instance: Rectangle(columns.start, rows.start, columns.stop, rows.stop)
        for instance, place in found
        if place is not None
        for rows, columns in [place]
    }


def regions(
    relevance: Relevance,
    relations: Iterable[Relation],
    targets: Collection[str],
    boxes: Mapping[str, Rectangle],
    size: tuple[int, int],
    most_objects: int = MOST_OBJECTS,
) -> list[Roi]:
    """The regions of interest of one task in one scene.

    Every target that the image shows is in exactly one region's targets. What belongs together by
    relevant pairs makes one region, or several where it has more than `most_objects` objects: each
    then holds the objects nearest to its first target, by relevant pairs and then by pixels.

    Args:
        relevance: What bears on the task.
        relations: The relations of the scene, one per unordered pair.
        targets: The objects in question: undecided, inconsistent, timed out or wrong.
        boxes: Where in the image the visible objects are; others cannot be looked at.
        size: Width and height of the image in pixels.
        most_objects: Objects in a region at most.
    """
    neighbours: dict[str, set[str]] = defaultdict(set)
    for one, other in relevance.pairs(relations):
        if one in boxes and other in boxes:
            neighbours[one].add(other)
            neighbours[other].add(one)
    # From left to right, and from the bottom up: the order of the outputs of whole-image networks.
    waiting = [name for name in in_image_order(boxes) if name in targets]
    found = []
    while waiting:
        members = _group(waiting[0], neighbours, boxes, most_objects)
        inside = [name for name in waiting if name in members]
        waiting = [name for name in waiting if name not in members]
        found.append(_region(relevance, members, inside, boxes, size))
    return found


def in_image_order(boxes: Mapping[str, Rectangle]) -> list[str]:
    """The objects from the left to the right of the image; of equal ones the lower first."""
    return sorted(boxes, key=lambda name: (boxes[name].left, -boxes[name].bottom, name))


def crop(image: npt.NDArray[Pixel], roi: Roi) -> npt.NDArray[Pixel]:
    """The pixels of a region, a view of the image (H, W, ...).

    Raises:
        ValueError: If the region is empty or not inside the image.
    """
    height, width = image.shape[:2]
    right, bottom = roi.left + roi.width, roi.top + roi.height
    if min(roi.width, roi.height) < 1 or right > width or bottom > height:
        raise ValueError(
            f"region {roi.width}x{roi.height} at ({roi.left}, {roi.top}) is not inside the image "
            f"of {width}x{height} pixels"
        )
    return image[roi.top : bottom, roi.left : right]


def _group(
    first: str,
    neighbours: Mapping[str, Collection[str]],
    boxes: Mapping[str, Rectangle],
    most: int,
) -> list[str]:
    """The object and those it belongs to, nearest first."""
    members = [first]
    ring = [first]
    while ring and len(members) < most:
        reached = {other for name in ring for other in neighbours.get(name, ())} - set(members)
        ring = sorted(reached, key=lambda name: (boxes[name].gap(boxes[first]), name))
        members += ring[: most - len(members)]
    return members


def _region(
    relevance: Relevance,
    members: Sequence[str],
    targets: Sequence[str],
    boxes: Mapping[str, Rectangle],
    size: tuple[int, int],
) -> Roi:
    whole = boxes[members[0]]
    for name in members[1:]:
        whole = whole.union(boxes[name])
    longer = max(whole.right - whole.left, whole.bottom - whole.top)
    part = whole.grown(round(MARGIN * longer), *size)
    return Roi(
        task=relevance.task,
        left=part.left,
        top=part.top,
        width=part.right - part.left,
        height=part.bottom - part.top,
        objects=sorted(members),
        targets=list(targets),
        axioms=list(relevance.axioms),
        relations=list(relevance.relations),
    )
