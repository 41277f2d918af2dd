"""Objects found without instance ids, on frames whose objects are known."""

import numpy as np
import pytest
from box_scenes import Block, render

from ros_scenesense.geometry import Intrinsics, look_at
from ros_scenesense.perception.segmentation import Found, find_objects
from ros_scenesense.scene import Frame

CAMERA = Intrinsics(width=320, height=240, fx=330.0, fy=330.0, cx=160.0, cy=119.0)
POSE = look_at((-0.8, 0.0, 0.45), (0.0, 0.0, 0.05))
SIDE_BY_SIDE = (Block("one", (0.0, 0.2, 0.0)), Block("other", (0.0, -0.2, 0.0)))
STACKED = (
    Block("lower", (0.0, 0.0, 0.0), (0.1, 0.1, 0.1)),
    Block("upper", (0.0, 0.02, 0.1), (0.06, 0.06, 0.08)),
)
COLORS = np.array([[140, 120, 100], [200, 40, 40], [40, 60, 200]], dtype=np.uint8)


def frame_of(blocks, *, colored: bool = True, camera=POSE, intrinsics=CAMERA) -> Frame:
    frame = render(blocks, camera=camera, intrinsics=intrinsics)
    if colored:
        frame.color[...] = COLORS[frame.instances]
    return frame


def find(frame: Frame, **changes) -> Found:
    values = {"color": frame.color, "depth": frame.depth, "intrinsics": frame.intrinsics, **changes}
    return find_objects(**values, rng=np.random.default_rng(0))


def overlaps(found: np.ndarray, true: np.ndarray) -> list[float]:
    """Of each true object, the intersection over union with what covers it best."""
    best = []
    for number in range(1, int(true.max()) + 1):
        mine = true == number
        shares = [
            np.count_nonzero(mine & (found == other)) / np.count_nonzero(mine | (found == other))
            for other in range(1, int(found.max()) + 1)
        ]
        best.append(max(shares, default=0.0))
    return best


@pytest.mark.parametrize(
    ("blocks", "colored"), [(SIDE_BY_SIDE, True), (SIDE_BY_SIDE, False), (STACKED, True)]
)
def test_every_object_is_found_and_nothing_else(blocks, colored):
    frame = frame_of(blocks, colored=colored)
    found = find(frame)
    assert found.wrong is None
    assert found.instances.dtype == np.uint16
    assert int(found.instances.max()) == len(blocks)
    assert min(overlaps(found.instances, frame.instances)) > 0.85


def test_objects_are_numbered_from_left_to_right():
    found = find(frame_of(SIDE_BY_SIDE)).instances
    columns = np.broadcast_to(np.arange(CAMERA.width), found.shape)
    assert columns[found == 1].mean() < columns[found == 2].mean()
