"""Object clouds, boxes, and the cloud of a whole frame."""

import dataclasses

import numpy as np
import pytest
from box_scenes import Block, render
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.geometry import Intrinsics
from ros_scenesense.perception.boxes import oriented_box, robust_bounds
from ros_scenesense.perception.clouds import background_points, frame_cloud, object_clouds
from ros_scenesense.scene import Frame


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def frame_of(depth: np.ndarray, instances: np.ndarray | None = None) -> Frame:
    height, width = depth.shape
    return Frame(
        stamp_ns=0,
        frame_id="camera",
        color=np.arange(height * width * 3, dtype=np.uint8).reshape(height, width, 3),
        depth=depth.astype(np.float32),
        intrinsics=Intrinsics(width, height, 100.0, 110.0, width / 2.0, height / 2.0 - 1.0),
        instances=instances,
    )


def test_each_object_gets_exactly_its_own_points():
    instances = np.array([[0, 3, 3], [9, 0, 3]], dtype=np.uint16)
    depth = np.linspace(1.0, 1.02, 6).reshape(2, 3)
    points = frame_of(depth).intrinsics.back_project(depth)
    nine, three, absent = object_clouds(points, instances, [9, 3, 5], 100, rng())
    assert nine.readings == 1
    np.testing.assert_array_equal(nine.points, points[1:2, 0])
    assert three.readings == 3
    np.testing.assert_array_equal(three.points, points[[0, 0, 1], [1, 2, 2]])
    assert (absent.readings, absent.points.shape) == (0, (0, 3))


@pytest.mark.parametrize("nothing", [0.0, -1.0, np.nan, np.inf])
def test_pixels_without_a_reading_are_no_points(nothing):
    depth = np.array([[1.0, nothing], [nothing, 1.01]])
    points = frame_of(depth).intrinsics.back_project(depth)
    (cloud,) = object_clouds(points, np.ones((2, 2), np.uint16), [1], 100, rng())
    assert cloud.readings == 2
    assert cloud.points[:, 2].tolist() == [1.0, 1.01]
    assert len(background_points(points, np.zeros((2, 2), np.uint16), 100, rng())) == 2


@given(st.integers(1, 60), st.integers(1, 60))
def test_samples_are_distinct_points_of_the_object(readings, limit):
    depth = np.linspace(1.0, 2.0, 60).reshape(6, 10)
    instances = (np.arange(60).reshape(6, 10) < readings).astype(np.uint16)
    points = frame_of(depth).intrinsics.back_project(depth)
    (cloud,) = object_clouds(points, instances, [1], limit, rng())
    assert cloud.readings == readings
    drawn = {tuple(point) for point in cloud.points}
    assert len(cloud.points) == len(drawn) == min(readings, limit)
    assert drawn <= {tuple(point) for point in points[instances == 1]}


def test_same_seed_same_sample():
    frame = render([Block("a", (0.0, 0.0, 0.0))])
    points = frame.intrinsics.back_project(frame.depth)
    first, second = (object_clouds(points, frame.instances, [1], 50, rng())[0] for _ in range(2))
    np.testing.assert_array_equal(first.points, second.points)


def test_robust_bounds_ignore_stray_points():
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (400, 3))
    points[:8] = 50.0
    low, high = robust_bounds(points)
    assert np.all(np.abs(low + 0.94) < 0.05)
    assert np.all(np.abs(high - 0.97) < 0.05)


def test_bounds_of_a_single_point_are_the_point():
    low, high = robust_bounds(np.array([[1.0, 2.0, 3.0]]))
    assert low.tolist() == high.tolist() == [1.0, 2.0, 3.0]


@given(st.floats(-3.0, 3.0))
def test_oriented_box_has_its_corners_where_the_bounds_are(angle):
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    low, high = np.array([0.1, -0.4, 1.0]), np.array([0.5, 0.2, 1.3])
    corners = oriented_box(low, high, axes).corners() @ axes.T
    np.testing.assert_allclose(corners.min(axis=0), low, atol=1e-9)
    np.testing.assert_allclose(corners.max(axis=0), high, atol=1e-9)


def test_frame_cloud_is_the_back_projection_with_its_colours():
    depth = np.array([[1.0, 0.0, 2.0], [np.nan, 1.5, np.inf]])
    frame = frame_of(depth)
    points, colors = frame_cloud(frame, 0.0)
    seen = np.isfinite(depth) & (depth > 0.0)
    np.testing.assert_allclose(points, frame.intrinsics.back_project(frame.depth)[seen], rtol=1e-6)
    np.testing.assert_array_equal(colors, frame.color[seen])
    assert (points.dtype, colors.dtype) == (np.float32, np.uint8)


def test_frame_cloud_keeps_one_point_per_voxel():
    frame = render([Block("a", (0.0, 0.0, 0.0))])
    points, colors = frame_cloud(frame, 0.02)
    assert len(points) == len(colors)
    # Points of different voxels may be near each other, but no voxel holds many.
    assert 0 < len(points) < 0.5 * np.count_nonzero(frame.depth)


@pytest.mark.parametrize("depth", [0.0, np.nan, 3e38])
def test_frame_cloud_of_an_image_without_use_is_empty(depth):
    frame = dataclasses.replace(render([]), depth=np.full((120, 160), depth, dtype=np.float32))
    points, colors = frame_cloud(frame, 0.005)
    assert points.shape == colors.shape == (0, 3)


def test_readings_that_mix_an_object_with_what_is_behind_are_left_out():
    depth = np.full((64, 640), 1.5)
    depth[:, 300:340] = 1.0
    depth[:, [299, 340]] = 1.25  # mixed
    instances = np.zeros((64, 640), np.uint16)
    instances[:, 299:341] = 1
    points = frame_of(depth).intrinsics.back_project(depth)
    (cloud,) = object_clouds(points, instances, [1], 10_000, rng())
    assert cloud.readings == 64 * 40
    assert set(cloud.points[:, 2]) == {1.0}


def test_a_slender_object_keeps_its_readings():
    depth = np.full((64, 640), 1.5)
    depth[:, :100] = 1.0
    instances = np.zeros((64, 640), np.uint16)
    instances[:, 100:102] = 1  # nothing but readings beside a nearer surface
    points = frame_of(depth).intrinsics.back_project(depth)
    (cloud,) = object_clouds(points, instances, [1], 10_000, rng())
    assert cloud.readings == 64 * 2
