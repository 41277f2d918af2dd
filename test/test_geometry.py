"""Poses, projection and boxes: every function against its inverse or its definition."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from message_strategies import unit_quaternions

from ros_scenesense.geometry import (
    Box,
    Intrinsics,
    Pose,
    look_at,
    pose_of,
    quaternion_of,
    rotation_matrix,
    transform_points,
)

HALF = math.sqrt(0.5)
CAMERA = Intrinsics(width=40, height=30, fx=35.0, fy=45.0, cx=20.0, cy=14.0)
METRES = st.floats(-10.0, 10.0)
POINTS = st.tuples(METRES, METRES, METRES)
POSES = st.builds(Pose, POINTS, unit_quaternions())


@given(unit_quaternions())
@example((1.0, 0.0, 0.0, 0.0))
@example((0.0, 1.0, 0.0, 0.0))
@example((0.0, 0.0, 1.0, 0.0))
@example((HALF, HALF, 0.0, 0.0))
@example((0.6, 0.0, -0.8, 1e-9))
@example((0.0, 0.0, 0.0, -1.0))
def test_quaternion_and_matrix_are_inverse(quaternion):
    matrix = rotation_matrix(quaternion)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    back = quaternion_of(matrix)
    assert back[3] >= 0.0
    assert math.hypot(*back) == pytest.approx(1.0)
    # A quaternion and its negative are the same rotation.
    assert abs(np.dot(back, quaternion)) == pytest.approx(1.0)
    np.testing.assert_allclose(rotation_matrix(back), matrix, atol=1e-9)


def test_a_quarter_turn_about_up_turns_forward_to_the_left():
    matrix = rotation_matrix((0.0, 0.0, HALF, HALF))
    np.testing.assert_allclose(matrix @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12)


def test_rotation_matrix_normalises():
    np.testing.assert_allclose(rotation_matrix((0.0, 0.0, 0.0, 2.0)), np.eye(3))


@given(POSES, st.lists(POINTS, min_size=1, max_size=5))
def test_pose_and_matrix_are_inverse(pose, points):
    back = pose_of(pose.matrix())
    np.testing.assert_allclose(back.matrix(), pose.matrix(), atol=1e-9)
    moved = transform_points(pose.matrix(), np.array(points))
    returned = transform_points(np.linalg.inv(pose.matrix()), moved)
    np.testing.assert_allclose(returned, points, atol=1e-9)


@pytest.mark.parametrize(
    "orientation", [(0.0,) * 4, (0.0, 0.0, 0.0, 1.1), (math.nan, 0.0, 0.0, 1.0), (1e200,) * 4]
)
def test_a_pose_without_a_rotation_is_refused(orientation):
    with pytest.raises(ValueError, match="must be 1"):
        Pose(position=(0.0, 0.0, 0.0), orientation=orientation)


@given(eye=POINTS, target=POINTS)
def test_look_at_puts_the_target_ahead_and_up_upwards(eye, target):
    forward = np.subtract(target, eye)
    if math.hypot(forward[0], forward[1]) < 1e-3:
        return
    matrix = look_at(eye, target).matrix()
    ahead = transform_points(np.linalg.inv(matrix), np.array([target]))[0]
    np.testing.assert_allclose(ahead, [0.0, 0.0, np.linalg.norm(forward)], atol=1e-6)
    np.testing.assert_allclose(matrix[:3, 3], eye, atol=1e-12)
    right, down = matrix[:3, 0], matrix[:3, 1]
    assert right[2] == pytest.approx(0.0, abs=1e-9)
    assert down[2] < 0.0


def test_the_axes_of_a_camera_that_looks_forward():
    matrix = look_at((0.0, 0.0, 1.0), (5.0, 0.0, 1.0)).matrix()
    np.testing.assert_allclose(matrix[:3, 0], [0.0, -1.0, 0.0], atol=1e-12)  # right
    np.testing.assert_allclose(matrix[:3, 1], [0.0, 0.0, -1.0], atol=1e-12)  # down
    np.testing.assert_allclose(matrix[:3, 2], [1.0, 0.0, 0.0], atol=1e-12)  # forward


@pytest.mark.parametrize("target", [(1.0, 2.0, 0.0), (1.0, 2.0, 9.0), (1.0, 2.0, 3.0)])
def test_look_at_refuses_to_look_straight_up_down_or_nowhere(target):
    with pytest.raises(ValueError, match="no upright image"):
        look_at((1.0, 2.0, 3.0), target)


@given(st.integers(0, 39), st.integers(0, 29), st.floats(0.01, 100.0))
def test_project_undoes_back_project(column, row, depth_m):
    depth = np.zeros((30, 40), np.float32)
    depth[row, column] = depth_m
    points = CAMERA.back_project(depth)
    assert points.shape == (30, 40, 3)
    assert np.isfinite(points).all(axis=-1).sum() == 1
    point = points[row, column]
    assert point[2] == pytest.approx(depth_m, rel=1e-6)
    np.testing.assert_allclose(CAMERA.project(point[None]), [[column, row]], atol=1e-9)


def test_pixels_without_a_reading_have_no_point():
    depth = np.full((30, 40), np.nan, np.float32)
    depth[0, :3] = [0.0, -1.0, np.inf]
    assert np.isnan(CAMERA.back_project(depth)[..., 2]).all()


def test_the_principal_point_looks_along_the_axis():
    np.testing.assert_allclose(CAMERA.rays()[14, 20], [0.0, 0.0, 1.0])
    np.testing.assert_allclose(CAMERA.rays()[14, 21], [1 / 35, 0.0, 1.0])
    np.testing.assert_allclose(CAMERA.rays()[15, 20], [0.0, 1 / 45, 1.0])


@given(POSES, st.tuples(*[st.floats(0.0, 2.0)] * 3))
def test_corners_of_a_box_are_where_its_edges_say(pose, size):
    corners = Box(pose=pose, size=size).corners()
    assert corners.shape == (8, 3)
    local = transform_points(np.linalg.inv(pose.matrix()), corners)
    np.testing.assert_allclose(np.abs(local), np.tile(np.divide(size, 2), (8, 1)), atol=1e-9)
    np.testing.assert_allclose(corners.mean(axis=0), pose.position, atol=1e-9)
    if min(size) > 1e-3:
        assert len(np.unique(np.sign(local), axis=0)) == 8
