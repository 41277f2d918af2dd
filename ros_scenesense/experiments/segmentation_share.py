"""How many objects the segmentation finds in frames that come without instance ids."""

from __future__ import annotations

import numpy as np

from ros_scenesense.perception.segmentation import Instances, find_objects
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.noise import KINECT, PRESETS, noisy

_OVERLAP = 0.7
_NAMES = {"segmentation_iou70": False, "segmentation_iou70_kinect": True}


def segmentation_shares(seed: int, frames: int) -> dict[str, float]:
    """Shares of the objects of simulated frames that are found, by more than 70 % overlap.

    The frames (640x480) show towers, spread objects, and both together, with textures and
    backgrounds; once with perfect depth, once with the noise of a Kinect.

    Args:
        seed: Of the scenes and the noise.
        frames: How many.

    Returns:
        Intersection over union above 0.7, as a share from 0 to 1, by the names of the figures.
    """
    engine = SimulationEngine(SimulationConfiguration(width=640, height=480))
    hits: dict[str, list[bool]] = {name: [] for name in _NAMES}
    for index in range(frames):
        frame = engine.scene(seed, index).frame
        assert frame.instances is not None
        rng = np.random.default_rng([seed, index])
        for name, is_noisy in _NAMES.items():
            depth = frame.depth
            if is_noisy:
                depth = noisy(depth, frame.intrinsics, PRESETS[KINECT], rng)
            found = find_objects(frame.color, depth, frame.intrinsics, rng).instances
            hits[name] += [one > _OVERLAP for one in _best_overlaps(frame.instances, found)]
    engine.close()
    return {name: float(np.mean(several)) for name, several in hits.items()}


def _best_overlaps(true: Instances, found: Instances) -> list[float]:
    """Of each true object, the intersection over union with the found one that fits it best."""
    shape = int(true.max()) + 1, int(found.max()) + 1
    both = np.zeros(shape, dtype=np.int64)
    np.add.at(both, (true.ravel(), found.ravel()), 1)
    union = both.sum(axis=1)[:, None] + both.sum(axis=0)[None] - both
    overlaps = both[1:, 1:] / np.maximum(union[1:, 1:], 1)
    return [float(row.max(initial=0.0)) for row in overlaps]
