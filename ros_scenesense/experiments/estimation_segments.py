"""Scenes as they are where nobody gives instance ids: objects are what segmentation finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import rotation_matrix
from ros_scenesense.perception.segmentation import find_objects
from ros_scenesense.simulation.engine import SimulatedScene

_FIT = 0.5
"""Intersection over union; above, no two objects fit the same."""


def segmented(scene: SimulatedScene, rng: np.random.Generator) -> SimulatedScene:
    """The scene as it is for who finds its objects by segmentation; what is not found is left out.

    Args:
        scene: A simulated scene.
        rng: Source of the samples of segmentation.
    """
    frame = scene.frame
    pose = frame.camera_pose
    up = None if pose is None else rotation_matrix(pose.orientation)[2]
    found = find_objects(frame.color, frame.depth, frame.intrinsics, rng, up).instances
    assert frame.instances is not None
    instances = own_instances(frame.instances, found)
    there = set(np.unique(instances).tolist())
    return replace(
        scene,
        frame=replace(frame, instances=instances),
        objects=[each for each in scene.objects if each.instance in there],
    )


def own_instances(
    true: npt.NDArray[np.uint16], found: npt.NDArray[np.uint16]
) -> npt.NDArray[np.uint16]:
    """What a segmentation found, with the ids of the true objects where it found one.

    Args:
        true: (H, W) ids of the simulator.
        found: (H, W) ids of the segmentation.

    Returns:
        (H, W): what shares more than half of all its pixels with a true object has the id of that
        object; what fits none has an id that the simulator did not give.
    """
    shape = int(true.max()) + 1, int(found.max()) + 1
    both = np.zeros(shape, np.int64)
    np.add.at(both, (true.ravel(), found.ravel()), 1)
    union = both.sum(axis=1)[:, None] + both.sum(axis=0)[None] - both
    fits = both / np.maximum(union, 1) > _FIT
    names = np.arange(shape[1]) + shape[0]  # of strangers
    names[0] = 0
    for one, other in zip(*np.nonzero(fits[1:, 1:]), strict=True):
        names[other + 1] = one + 1
    return names[found].astype(np.uint16)
