"""What is looked at in a scene: the regions of interest, and one query for each literal in them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.footprint import box_footprint, footprint_of
from ros_scenesense.attention.inputs import query_image, query_numbers
from ros_scenesense.attention.outline import outline_of
from ros_scenesense.attention.overhang import overhangs
from ros_scenesense.attention.regions import rectangles, regions
from ros_scenesense.attention.relevance import Relevance
from ros_scenesense.attention.scan import viewer_axes
from ros_scenesense.geometry import Box, Float, rotation_matrix
from ros_scenesense.messages.attention import Roi
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.reasoning import Beliefs
from ros_scenesense.scene import DecisionStatus, Frame, Position, Surface, Task


@dataclass(frozen=True, eq=False)
class Query:
    """One literal in question, as the query network is shown it.

    Attributes:
        task: Which fluent.
        target: Of which object.
        image: (6, side, side), see `inputs.query_image`.
        numbers: (6,), see `inputs.query_numbers`.
        objects: The objects of its region.
    """

    task: Task
    target: str
    image: npt.NDArray[np.float32]
    numbers: npt.NDArray[np.float32]
    objects: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SeenScene:
    """All that attention knows of a scene.

    Attributes:
        frame: Its images.
        instances: (H, W) instance ids that grounding used.
        objects: The objects.
        relations: Their relations.
        beliefs: What reasoning says.
    """

    frame: Frame
    instances: npt.NDArray[np.uint16]
    objects: Objects
    relations: Relations
    beliefs: Beliefs

    def undecided(self, task: Task, doubt_defaults: bool = False) -> set[str]:
        """The objects of which reasoning does not decide the task's literal.

        Args:
            task: The task.
            doubt_defaults: Whether what only a default concludes counts as not decided.
        """
        found = set()
        for each in self.beliefs.objects:
            belief = each.stable if task is Task.STABILITY else each.occluded
            doubtful = doubt_defaults and belief.status is DecisionStatus.BY_DEFAULT
            if belief.value is None or doubtful:
                found.add(each.name)
        return found


def regions_of(scene: SeenScene, relevance: Relevance, targets: Collection[str]) -> list[Roi]:
    """The regions of interest around the targets of one task."""
    places = rectangles(scene.instances)
    boxes = {
        each.name: places[each.instance]
        for each in scene.objects.objects
        if each.instance in places
    }
    height, width = scene.instances.shape
    return regions(relevance, scene.relations.relations, targets, boxes, (width, height))


def queries_of(
    scene: SeenScene, relevances: Mapping[Task, Relevance], rois: Sequence[Roi], side: int
) -> list[Query]:
    """One query for each target of each region.

    Args:
        scene: The scene.
        relevances: What bears on each task.
        rois: Regions in its image.
        side: Pixels of the network's input.
    """
    instance = {each.name: each.instance for each in scene.objects.objects}
    stability = any(roi.task is Task.STABILITY for roi in rois)
    hanging = _overhangs(scene) if stability else {}
    pairs = {task: list(each.pairs(scene.relations.relations)) for task, each in relevances.items()}
    found = []
    for roi in rois:
        for target in roi.targets:
            related = {
                instance[other]
                for pair in pairs[roi.task]
                if target in pair
                for other in pair
                if other != target and other in roi.objects
            }
            image = query_image(scene.frame, scene.instances, roi, instance[target], related, side)
            leans = hanging.get(target) if roi.task is Task.STABILITY else None
            outline = outline_of(scene.frame.depth, scene.instances, instance[target], related)
            numbers = query_numbers(leans, outline)
            found.append(Query(roi.task, target, image, numbers, tuple(roi.objects)))
    return found


def _overhangs(scene: SeenScene) -> dict[str, float]:
    """The overhang, in metres, of every object that stands on another."""
    boxes = {each.name: each.box for each in scene.objects.objects if each.box is not None}
    if not boxes:
        return {}
    axes = viewer_axes(rotation_matrix(next(iter(boxes.values())).pose.orientation)[:, 2])
    supports = _supports(scene, {name: _top(box, axes) for name, box in boxes.items()})
    stacked = {name for pair in supports for name in pair}
    covered = {lower for _, lower in supports}
    places = rectangles(scene.instances) if stacked else {}
    footprints, irregular = {}, set()
    for each in scene.objects.objects:
        if each.name not in stacked or each.box is None:
            continue
        if each.surface is not None and each.surface.value is Surface.IRREGULAR:
            irregular.add(each.name)
        found = None
        if each.instance in places:
            place = places[each.instance]
            part = np.s_[place.top : place.bottom, place.left : place.right]
            found = footprint_of(
                scene.frame.depth[part],
                scene.frame.intrinsics,
                scene.instances[part] == each.instance,
                place,
                axes,
                each.name in covered,
            )
        footprints[each.name] = found or box_footprint(each.box, axes)
    return overhangs(footprints, supports, irregular)


def _top(box: Box, axes: Float) -> float:
    return float((box.corners() @ axes[2]).max())


def _supports(scene: SeenScene, tops: Mapping[str, float]) -> list[tuple[str, str]]:
    """Who stands on whom: pairs (upper, lower) of located objects.

    Where things touch in a point, that is often not seen: what is above others, and on none as far
    as is known, is taken to stand on the highest of them.
    """
    found = [
        (each.object, each.reference)
        for each in scene.beliefs.derived
        if each.relation == "on" and each.object in tops and each.reference in tops
    ]
    standing = {upper for upper, _ in found}
    beneath: dict[str, list[str]] = {}
    for each in scene.relations.relations:
        upper, lower = each.object, each.reference
        if each.position is Position.BELOW:
            upper, lower = lower, upper
        elif each.position is not Position.ABOVE:
            continue
        if upper not in standing and upper in tops and lower in tops:
            beneath.setdefault(upper, []).append(lower)
    nearest = [(upper, max(lower, key=tops.__getitem__)) for upper, lower in beneath.items()]
    return found + nearest
