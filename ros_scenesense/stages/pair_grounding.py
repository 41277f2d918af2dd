"""What both models say of every pair of a scene, in the axes of people."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float
from ros_scenesense.grounding.extent import Extent
from ros_scenesense.grounding.frames import NamingAxes, gravity_axes
from ros_scenesense.grounding.histograms import SceneHistograms, describe
from ros_scenesense.grounding.memory import GroundingMemory
from ros_scenesense.grounding.qsr import ground_pairs, measure_distances
from ros_scenesense.messages.grounding import PairGrounding
from ros_scenesense.perception.boxes import robust_bounds
from ros_scenesense.scene import NamingFrame


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
    extents = _extents(clouds, axes)
    # What is hidden depends on where the camera is and looks, not on whose left and right it is.
    # The camera is the origin however its axes are turned.
    seen = extents
    if axes.name is not NamingFrame.VIEWER:
        seen = _extents(clouds, gravity_axes(axes.rows[2]))
    distances = measure_distances(seen, _CAMERA, rule)
    turned = axes.turned(memory.yaw_rad)
    named = extents if turned is axes else _extents(clouds, turned)
    by_rule = ground_pairs(named, distances, _CAMERA, rule)
    histograms = describe(named, distances, _CAMERA, memory.yaw_rad)
    learned = memory.model.ground(histograms)
    by_viewer = {}
    if turned.name is NamingFrame.ROBOT:
        by_viewer = ground_pairs(seen, distances, _CAMERA, rule)
    pairs = [
        PairGrounding(
            object=names[i],
            reference=names[j],
            qsr=said,
            msr=learned.get((i, j)),
            viewer_position=by_viewer[i, j].position if by_viewer else None,
        )
        for (i, j), said in by_rule.items()
    ]
    return GroundedPairs(pairs, names, extents, histograms)


_CAMERA = np.zeros(3)


def _extents(clouds: Mapping[str, Float], axes: NamingAxes) -> list[Extent]:
    turned = [points @ axes.rows.T for points in clouds.values()]
    return [Extent(points, *robust_bounds(points)) for points in turned]
