"""Frames, segmentations, clouds and poses as ROS messages, and back.

What is received is checked: an image of another encoding, size or byte order raises a `FrameError`
that says what was found and what is taken.
"""

from __future__ import annotations

import array
import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Quaternion, TransformStamped, Vector3
from geometry_msgs.msg import Pose as PoseMessage
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Header

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Intrinsics, Pose
from ros_scenesense.stages.protocol import Cloud

SECOND = 1_000_000_000
Scalar = TypeVar("Scalar", bound=np.generic)


def header_of(stamp_ns: int, frame_id: str) -> Header:
    """A header; times before 1970 or after 2038 do not fit into ROS 2 time."""
    seconds, nanoseconds = divmod(stamp_ns, SECOND)
    return Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id=frame_id)


def stamp_of(header: Header) -> int:
    """The stamp of a header in nanoseconds."""
    return int(header.stamp.sec) * SECOND + int(header.stamp.nanosec)


def image_message(header: Header, pixels: npt.NDArray[np.generic], encoding: str) -> Image:
    """An image (H, W) or (H, W, channels) as a message; `encoding` must fit to its type."""
    height, width = pixels.shape[:2]
    row_bytes = pixels.nbytes // height
    message = Image(
        header=header, height=height, width=width, encoding=encoding, is_bigendian=0, step=row_bytes
    )
    message.data = _bytes_of(pixels)
    return message


def color_of(message: Image) -> npt.NDArray[np.uint8]:
    """Colour (H, W, 3) uint8 RGB from rgb8 or bgr8, or from rgba8 or bgra8 without the alpha.

    Raises:
        FrameError: If the message is not such an image.
    """
    _check_encoding("colour", message, ("rgb8", "bgr8", "rgba8", "bgra8"))
    channels = 4 if "a" in message.encoding else 3
    pixels = _rows("colour", message, np.uint8, channels)
    pixels = pixels.reshape(message.height, message.width, channels)[..., :3]
    return np.ascontiguousarray(pixels[..., ::-1] if message.encoding[0] == "b" else pixels)


def depth_of(message: Image) -> npt.NDArray[np.float32]:
    """Depth (H, W) float32 metres from 32FC1 (metres), or 16UC1 or mono16 (millimetres).

    0 is where nothing was read.

    Raises:
        FrameError: If the message is not such an image.
    """
    _check_encoding("depth", message, ("32FC1", "16UC1", "mono16"))
    if message.encoding == "32FC1":
        return _rows("depth", message, np.float32)
    return _rows("depth", message, np.uint16).astype(np.float32) / np.float32(1000.0)


def instances_of(message: Image) -> npt.NDArray[np.uint16]:
    """Instance ids (H, W) uint16 from 16UC1 or mono16.

    Raises:
        FrameError: If the message is not such an image.
    """
    _check_encoding("instance", message, ("16UC1", "mono16"))
    return _rows("instance", message, np.uint16)


def camera_info_message(header: Header, intrinsics: Intrinsics) -> CameraInfo:
    """A pinhole camera without distortion as a message."""
    fx, fy, cx, cy = (
        float(value) for value in (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy)
    )
    return CameraInfo(
        header=header,
        height=intrinsics.height,
        width=intrinsics.width,
        distortion_model="plumb_bob",
        d=[0.0] * 5,
        k=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def intrinsics_of(message: CameraInfo) -> Intrinsics:
    """The intrinsics in the matrix K; the images are taken as rectified.

    Raises:
        FrameError: If K is not finite.
    """
    values = [float(message.k[index]) for index in (0, 4, 2, 5)]
    if not all(math.isfinite(value) for value in values):
        raise FrameError("camera info has a matrix K that is not finite: calibrate the camera")
    return Intrinsics(int(message.width), int(message.height), *values)


def cloud_message(cloud: Cloud) -> PointCloud2:
    """A coloured cloud with the fields x, y, z (metres) and rgb, packed as RViz expects it."""
    red, green, blue = (cloud.colors[:, channel].astype(np.uint32) for channel in range(3))
    points = np.empty((len(cloud.points), 4), np.float32)
    points[:, :3] = cloud.points
    points[:, 3] = ((red << 16) | (green << 8) | blue).view(np.float32)
    message = PointCloud2(
        header=header_of(cloud.stamp_ns, cloud.frame_id),
        height=1,
        width=len(points),
        fields=[
            PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
            for index, name in enumerate(("x", "y", "z", "rgb"))
        ],
        is_bigendian=False,
        point_step=16,
        row_step=16 * len(points),
        is_dense=bool(np.isfinite(cloud.points).all()),
    )
    message.data = _bytes_of(points)
    return message


def cloud_of(message: PointCloud2) -> Cloud:
    """The cloud in a message as `cloud_message` makes them."""
    points = np.frombuffer(message.data, np.float32).reshape(-1, 4)
    packed = np.ascontiguousarray(points[:, 3]).view(np.uint32)
    colors = np.stack([packed >> 16, packed >> 8, packed], axis=1) & 0xFF
    return Cloud(
        stamp_of(message.header), message.header.frame_id, points[:, :3], colors.astype(np.uint8)
    )


def pose_message(pose: Pose) -> PoseMessage:
    """A pose as a message."""
    px, py, pz = (float(value) for value in pose.position)
    x, y, z, w = (float(value) for value in pose.orientation)
    return PoseMessage(position=Point(x=px, y=py, z=pz), orientation=Quaternion(x=x, y=y, z=z, w=w))


def pose_of_message(message: PoseMessage) -> Pose:
    """The pose in a message."""
    position, orientation = message.position, message.orientation
    return Pose(
        position=(position.x, position.y, position.z),
        orientation=(orientation.x, orientation.y, orientation.z, orientation.w),
    )


def transform_message(stamp_ns: int, parent: str, child: str, pose: Pose) -> TransformStamped:
    """The pose of frame `child` in frame `parent` as a transform for `/tf`."""
    message = TransformStamped(header=header_of(stamp_ns, parent), child_frame_id=child)
    x, y, z = (float(value) for value in pose.position)
    message.transform.translation = Vector3(x=x, y=y, z=z)
    message.transform.rotation = pose_message(pose).orientation
    return message


def _bytes_of(pixels: npt.NDArray[np.generic]) -> array.array[int]:
    # Any other type is checked byte by byte: 78 ms instead of 0.1 ms for a colour image.
    data = array.array("B")
    data.frombytes(pixels.tobytes())
    return data


def _check_encoding(what: str, message: Image, allowed: tuple[str, ...]) -> None:
    if message.encoding not in allowed:
        raise FrameError(
            f"{what} image has encoding '{message.encoding[:40]}', must be {' or '.join(allowed)}"
        )


def _rows(what: str, message: Image, dtype: type[Scalar], channels: int = 1) -> npt.NDArray[Scalar]:
    """The pixels (H, W * channels), without the padding of the rows."""
    height, width, step = message.height, message.width, message.step
    pixel_bytes = np.dtype(dtype).itemsize
    row_bytes = width * channels * pixel_bytes
    if height == 0 or width == 0:
        raise FrameError(f"{what} image is empty ({width}x{height})")
    if pixel_bytes > 1 and message.is_bigendian:
        raise FrameError(f"{what} image is big-endian: publish little-endian images")
    if step < row_bytes or len(message.data) != step * height:
        raise FrameError(
            f"{what} image of {width}x{height} {message.encoding} has {len(message.data)} bytes in "
            f"rows of {step}: rows must have at least {row_bytes}, and the data rows x {height}"
        )
    rows = np.frombuffer(message.data, np.uint8).reshape(height, step)[:, :row_bytes]
    return np.ascontiguousarray(rows).view(dtype)
