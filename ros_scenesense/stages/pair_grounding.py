"""What both models say of every pair of a scene, in the axes of people."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float
from ros_scenesense.grounding.contact import seen_gaps
from ros_scenesense.grounding.distances import closest_distances
from ros_scenesense.grounding.extent import Extent
from ros_scenesense.grounding.frames import NamingAxes
from ros_scenesense.grounding.histograms import SceneHistograms, describe
from ros_scenesense.grounding.memory import GroundingMemory
from ros_scenesense.grounding.qsr import ground_pairs
from ros_scenesense.messages.grounding import PairGrounding
from ros_scenesense.perception.boxes import robust_bounds


@dataclass(frozen=True, eq=False)
class Learned:
    """What the grounding stage knows when it hands out a scene.

    Attributes:
        memory: What was learned.
        applied: Id of the last `msr_update` that it contains; 0 = none.
    """

    memory: GroundingMemory
    applied: int = 0


@dataclass(frozen=True, eq=False)
class GroundedPairs:
    """The pairs of a scene.

    Attributes:
        pairs: Every directed pair.
        names: The located objects, in the order of the histograms.
        extents: They along the given axes.
        histograms: What was seen of the pairs, for the metric model to learn from.
    """

    pairs: list[PairGrounding]
    names: list[str]
    extents: list[Extent]
    histograms: SceneHistograms


def ground_scene(
    clouds: Mapping[str, Float], axes: NamingAxes, rule: str, memory: GroundingMemory
) -> GroundedPairs:
    """Grounds all pairs by both models.

    Relations are named along the given axes, turned as people's words tell.

    Args:
        clouds: Points (N, 3) of the located objects in the optical frame, metres.
        axes: The viewer's, or those of the robot.
        rule: Of the qualitative model, see `qsr`.
        memory: Gives the metric model, and by how much the axes of people are turned from these.
    """
    names = list(clouds)
    extents = [_extent(points, axes) for points in clouds.values()]
    # What is hidden depends on where the camera is: the origin, however its axes are turned.
    gaps = seen_gaps(extents, np.zeros(3))
    closest = closest_distances([one.points for one in extents])
    named = extents
    if memory.yaw_rad != 0.0:
        turned = axes.turned(memory.yaw_rad)
        named = [_extent(points, turned) for points in clouds.values()]
    by_rule = ground_pairs(named, closest, gaps, rule)
    histograms = describe(named, closest, gaps, memory.yaw_rad)
    learned = memory.model.ground(histograms)
    pairs = [
        PairGrounding(object=names[i], reference=names[j], qsr=said, msr=learned.get((i, j)))
        for (i, j), said in by_rule.items()
    ]
    return GroundedPairs(pairs, names, extents, histograms)


def _extent(points: Float, axes: NamingAxes) -> Extent:
    turned = points @ axes.rows.T
    return Extent(turned, *robust_bounds(turned))
