"""Objects found without instance ids, on frames whose objects are known."""

import numpy as np
import pytest
from box_scenes import Block, render

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Intrinsics, look_at, rotation_matrix
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


def test_without_objects_nothing_is_found():
    found = find(frame_of([]))
    assert found.wrong is None
    assert found.plane is not None
    assert not found.instances.any()


@pytest.mark.parametrize("empty", [0.0, np.nan, np.inf, -1.0])
def test_a_third_of_the_readings_missing_changes_little_whatever_stands_in_their_place(empty):
    frame = frame_of(STACKED)
    depth = frame.depth.copy()
    depth[np.random.default_rng(0).random(depth.shape) < 0.3] = empty
    found = find(frame, depth=depth)
    assert int(found.instances.max()) == 2
    assert min(overlaps(found.instances, frame.instances)) > 0.75


def test_a_patch_without_readings_costs_only_what_it_covers():
    frame = frame_of(SIDE_BY_SIDE)
    depth = frame.depth.copy()
    depth[:, :60] = 0.0
    depth[150:170] = 0.0
    found = find(frame, depth=depth)
    assert found.wrong is None
    assert min(overlaps(found.instances, frame.instances)) > 0.7


def test_readings_without_a_table_are_an_answer_with_a_reason():
    rng = np.random.default_rng(3)
    depth = rng.uniform(0.5, 3.0, (CAMERA.height, CAMERA.width)).astype(np.float32)
    found = find(frame_of([]), depth=depth)
    assert "no table plane" in found.wrong
    assert not found.instances.any()
    nothing = find(frame_of([]), depth=np.zeros_like(depth))
    assert "no pixel" in nothing.wrong


def test_what_fills_the_image_is_not_taken_for_an_empty_table():
    depth = np.full((CAMERA.height, CAMERA.width), 0.6, dtype=np.float32)
    assert "faces the camera" in find(frame_of([]), depth=depth).wrong
    level = np.array([0.0, -0.9, -0.43])
    assert (
        "no table plane" in find(frame_of([]), depth=depth, up=level / np.linalg.norm(level)).wrong
    )


def test_a_table_seen_from_straight_above_is_one_if_the_pose_says_so():
    above = look_at((-0.02, 0.0, 1.0), (0.0, 0.0, 0.0))
    frame = frame_of(SIDE_BY_SIDE, camera=above)
    assert "camera_pose" in find(frame).wrong
    up = rotation_matrix(above.orientation)[2]
    found = find(frame, up=up)
    assert found.wrong is None
    assert min(overlaps(found.instances, frame.instances)) > 0.8


def test_a_wall_behind_the_table_is_neither_the_table_nor_an_object():
    wall = Block("wall", (1.0, 0.0, -1.0), (0.1, 6.0, 4.0))
    frame = frame_of((*SIDE_BY_SIDE, wall), colored=False)
    found = find(frame)
    assert found.wrong is None
    assert int(found.instances.max()) == 2
    assert not found.instances[frame.instances == 3].any()


def test_images_of_another_size_are_refused():
    frame = frame_of(SIDE_BY_SIDE)
    with pytest.raises(FrameError, match="one size"):
        find(frame, color=frame.color[::2, ::2])
    with pytest.raises(FrameError, match="one size"):
        find(frame, depth=frame.depth[:-1])


def test_the_same_frame_gives_the_same_objects():
    frame = frame_of(STACKED)
    assert np.array_equal(find(frame).instances, find(frame).instances)


@pytest.mark.parametrize("scale", [0.5, 2.0, 4.0])
def test_other_resolutions_show_the_same_objects(scale):
    camera = Intrinsics(
        *(round(CAMERA.width * scale), round(CAMERA.height * scale)),
        *(CAMERA.fx * scale, CAMERA.fy * scale, CAMERA.cx * scale, CAMERA.cy * scale),
    )
    frame = frame_of(STACKED, intrinsics=camera)
    found = find(frame, intrinsics=camera)
    assert int(found.instances.max()) == 2
    assert min(overlaps(found.instances, frame.instances)) > 0.8
