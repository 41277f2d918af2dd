"""Images, clouds and poses survive ROS messages; wrong ones are refused in words."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from sensor_msgs.msg import Image

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Intrinsics, Pose
from ros_scenesense.nodes import conversions
from ros_scenesense.stages.protocol import Cloud

SIZES = st.tuples(st.integers(1, 9), st.integers(1, 9))
STAMPS = st.integers(0, 2**31 * 10**9 - 1)


def images(dtype, channels=()):
    return SIZES.flatmap(lambda size: hnp.arrays(dtype, (*size, *channels)))


def header(stamp_ns=1, frame_id="camera"):
    return conversions.header_of(stamp_ns, frame_id)


def padded(message: Image, padding: int) -> Image:
    """The same image with unused bytes at the end of each row, as drivers send them."""
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)
    wide = np.pad(rows, ((0, 0), (0, padding)), constant_values=7)
    other = Image(
        header=message.header,
        height=message.height,
        width=message.width,
        encoding=message.encoding,
        step=message.step + padding,
    )
    other.data = wide.tobytes()
    return other


@settings(max_examples=40, deadline=None)
@given(images(np.uint8, (3,)), st.integers(0, 5))
def test_color_round_trip(color, padding):
    message = padded(conversions.image_message(header(), color, "rgb8"), padding)
    np.testing.assert_array_equal(conversions.color_of(message), color)
    message.encoding = "bgr8"
    np.testing.assert_array_equal(conversions.color_of(message), color[..., ::-1])


@settings(max_examples=40, deadline=None)
@given(images(np.uint8, (4,)), st.integers(0, 5))
def test_alpha_is_left_out(color, padding):
    message = padded(conversions.image_message(header(), color, "rgba8"), padding)
    np.testing.assert_array_equal(conversions.color_of(message), color[..., :3])
    message.encoding = "bgra8"
    np.testing.assert_array_equal(conversions.color_of(message), color[..., 2::-1])


@settings(max_examples=40, deadline=None)
@given(images(np.float32), st.integers(0, 5))
def test_depth_round_trip(depth, padding):
    message = padded(conversions.image_message(header(), depth, "32FC1"), padding)
    np.testing.assert_array_equal(conversions.depth_of(message), depth)


@settings(max_examples=40, deadline=None)
@given(images(np.uint16), st.integers(0, 5))
def test_instances_round_trip_and_millimetres_become_metres(values, padding):
    message = padded(conversions.image_message(header(), values, "16UC1"), padding)
    np.testing.assert_array_equal(conversions.instances_of(message), values)
    depth = conversions.depth_of(message)
    assert depth.dtype == np.float32
    np.testing.assert_allclose(depth, values / 1000.0, rtol=1e-6)
    message.encoding = "mono16"
    np.testing.assert_array_equal(conversions.depth_of(message), depth)


@settings(max_examples=40, deadline=None)
@given(STAMPS, st.text(max_size=10).filter(lambda text: "\0" not in text))
def test_header_round_trip(stamp_ns, frame_id):
    message = conversions.header_of(stamp_ns, frame_id)
    assert (conversions.stamp_of(message), message.frame_id) == (stamp_ns, frame_id)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 30), st.integers(0, 2**32 - 1))
def test_cloud_round_trip(count, seed):
    generator = np.random.default_rng(seed)
    points = generator.normal(size=(count, 3)).astype(np.float32)
    colors = generator.integers(0, 256, (count, 3), dtype=np.uint8)
    message = conversions.cloud_message(Cloud(5, "camera", points, colors))
    assert len(message.data) == message.row_step == message.point_step * message.width
    back = conversions.cloud_of(message)
    np.testing.assert_array_equal(back.points, points)
    np.testing.assert_array_equal(back.colors, colors)
    assert (back.stamp_ns, back.frame_id) == (5, "camera")


def test_pose_transform_and_intrinsics():
    pose = Pose(position=(1.0, -2.0, 0.5), orientation=(0.0, 0.6, 0.0, 0.8))
    assert conversions.pose_of_message(conversions.pose_message(pose)) == pose
    transform = conversions.transform_message(7, "world", "camera", pose)
    assert (transform.header.frame_id, transform.child_frame_id) == ("world", "camera")
    assert transform.transform.translation.y == -2.0
    assert transform.transform.rotation.w == 0.8
    camera = Intrinsics(width=4, height=3, fx=10.0, fy=11.0, cx=1.5, cy=1.0)
    assert conversions.intrinsics_of(conversions.camera_info_message(header(), camera)) == camera


def good_depth() -> Image:
    return conversions.image_message(header(), np.ones((2, 3), np.float32), "32FC1")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"encoding": "64FC1"}, "64FC1"),
        ({"encoding": "x" * 500}, "must be 32FC1 or 16UC1"),
        ({"data": [1, 2, 3]}, "3 bytes"),
        ({"data": []}, "0 bytes"),
        ({"height": 0}, "empty"),
        ({"width": 0}, "empty"),
        ({"width": 4}, "rows of 12"),
        ({"height": 1}, "24 bytes"),
        ({"step": 0}, "rows of 0"),
        ({"is_bigendian": 1}, "big-endian"),
    ],
)
def test_a_wrong_image_is_refused_in_words(changes, said):
    message = good_depth()
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(FrameError, match=said) as refused:
        conversions.depth_of(message)
    assert len(str(refused.value)) < 300


@settings(max_examples=100, deadline=None)
@given(
    st.sampled_from([conversions.color_of, conversions.depth_of, conversions.instances_of]),
    st.integers(0, 5),
    st.integers(0, 5),
    st.integers(0, 40),
    st.sampled_from(["rgb8", "bgr8", "32FC1", "16UC1", "mono16", "mono8", "", "ä"]),
    st.binary(max_size=100),
)
def test_any_image_gives_pixels_or_a_frame_error(read, height, width, step, encoding, data):
    message = Image(height=height, width=width, step=step, encoding=encoding)
    message.data = data
    try:
        pixels = read(message)
    except FrameError:
        return
    assert pixels.shape[:2] == (height, width)


def test_camera_info_that_is_not_finite_is_refused():
    message = conversions.camera_info_message(header(), Intrinsics(4, 3, 10.0, 11.0, 1.5, 1.0))
    message.k[2] = float("nan")
    with pytest.raises(FrameError, match="calibrate"):
        conversions.intrinsics_of(message)
