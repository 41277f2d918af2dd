"""The naming axes: which way is right, away and up for a camera anywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.geometry import look_at, rotation_matrix
from ros_scenesense.grounding.frames import (
    CAMERA,
    GRAVITY,
    camera_axes,
    choose_axes,
    gravity_axes,
)
from ros_scenesense.scene import NamingFrame

UP, SIDE = np.array([0.0, -np.cos(0.5), -np.sin(0.5)]), np.array([1.0, 0.0, 0.0])
ANY_VIEW = st.tuples(st.floats(0.1, 1.5), st.floats(-3.1, 3.1), st.floats(-0.5, 0.5))


def up_of(pitch: float, roll: float) -> np.ndarray:
    """The direction against gravity for a camera looking down by `pitch`, rolled by `roll`."""
    upright = np.array([0.0, -np.cos(pitch), -np.sin(pitch)])
    c, s = np.cos(roll), np.sin(roll)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ upright


def test_camera_axes_are_the_images():
    right, away, up = camera_axes().rows
    assert (right.tolist(), away.tolist(), up.tolist()) == ([1, 0, 0], [0, 0, 1], [0, -1, 0])
    assert camera_axes().name is NamingFrame.CAMERA


@given(ANY_VIEW)
def test_gravity_axes_are_right_handed_and_level(view):
    pitch, _, roll = view
    up = up_of(pitch, roll)
    axes = gravity_axes(2.0 * up)
    np.testing.assert_allclose(axes.rows @ axes.rows.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes.rows) == pytest.approx(1.0)
    np.testing.assert_allclose(axes.rows[2], up, atol=1e-9)
    assert axes.rows[1][2] > 0.0  # away from the viewer, along the optical axis
    assert axes.name is NamingFrame.VIEWER


@given(st.floats(-3.1, 3.1), st.floats(0.2, 2.0))
def test_a_camera_pose_gives_world_up_and_the_horizontal_view(yaw, height):
    eye = (float(np.cos(yaw)), float(np.sin(yaw)), height)
    pose = look_at(eye, (0.0, 0.0, 0.0))
    axes, wrong = choose_axes(GRAVITY, None, pose)
    in_world = axes.rows @ rotation_matrix(pose.orientation).T
    np.testing.assert_allclose(in_world[2], [0.0, 0.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(in_world[1], [-np.cos(yaw), -np.sin(yaw), 0.0], atol=1e-9)
    assert "camera pose" in wrong


def test_looking_straight_down_away_is_the_top_of_the_image():
    axes = gravity_axes(np.array([0.0, 0.0, -1.0]))
    np.testing.assert_allclose(axes.rows, [[1, 0, 0], [0, -1, 0], [0, 0, -1]], atol=1e-9)


def test_the_table_is_preferred_and_nothing_is_wrong():
    pose = look_at((-1.0, 0.0, 0.5), (0.0, 0.0, 0.0))
    tilted = rotation_matrix(pose.orientation)[2] + [0.05, 0.0, 0.0]
    axes, wrong = choose_axes(GRAVITY, tilted / np.linalg.norm(tilted), pose)
    np.testing.assert_allclose(axes.rows[2], tilted / np.linalg.norm(tilted))
    assert wrong is None


def test_a_wall_is_not_taken_for_a_table_where_the_pose_is_known():
    pose = look_at((-1.0, 0.0, 0.5), (0.0, 0.0, 0.0))
    axes, wrong = choose_axes(GRAVITY, np.array([0.0, 0.0, -1.0]), pose)
    np.testing.assert_allclose(axes.rows[2], rotation_matrix(pose.orientation)[2])
    assert "tilted by 63 degrees" in wrong


@pytest.mark.parametrize(
    "normal", [None, SIDE, -SIDE, -UP], ids=["none", "left", "right", "ceiling"]
)
def test_without_table_and_pose_the_cameras_axes_serve_and_it_is_said(normal):
    axes, wrong = choose_axes(GRAVITY, normal, None)
    assert axes.name is NamingFrame.CAMERA
    assert "publish camera_pose" in wrong


def test_the_camera_frame_needs_nothing():
    assert choose_axes(CAMERA, None, None)[1] is None
    assert choose_axes(CAMERA, UP, None)[0].name is NamingFrame.CAMERA
