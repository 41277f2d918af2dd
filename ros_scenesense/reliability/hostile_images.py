"""Images that no node should take for one, and frames that are well formed and show nonsense."""

from __future__ import annotations

import array
from collections.abc import Iterator
from typing import Any

import numpy as np
from sensor_msgs.msg import CameraInfo, Image

from ros_scenesense.geometry import Intrinsics
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.scenes import KnownObject, Scene
from ros_scenesense.nodes.conversions import camera_info_message, header_of, image_message
from ros_scenesense.nodes.frames import TOPIC_OF_PART
from ros_scenesense.scene import Frame

ENCODINGS = {"color": "rgb8", "depth": "32FC1", "instances": "16UC1", "segmentation": "16UC1"}
TOPICS_OF_IMAGES = {**TOPIC_OF_PART, "segmentation": "segmentation"}
"""Topics by part: `camera_info` holds a CameraInfo, the others images."""
_FALSE_ENCODINGS = ("", "yuv422", "8UC7", "rgb8 ", "\u00df" * 50, "jpeg")
_LONG_AGO_NS = 10**9


def bad_image(part: str, rng: np.random.Generator) -> Image | CameraInfo:
    """A message of a part of a frame that cannot be read, with a stamp of its own of long ago."""
    header = header_of(_LONG_AGO_NS + int(rng.integers(10**15)), "fuzz")
    if part == "camera_info":
        message = camera_info_message(header, Intrinsics(32, 24, 30.0, 30.0, 16.0, 12.0))
        message.k[int(rng.choice([0, 2, 4, 5]))] = float(rng.choice([np.nan, np.inf, -np.inf]))
        return message
    width, height = (int(side) for side in rng.integers(1, 64, 2))
    message = image_message(header, _pixels(part, height, width, rng), ENCODINGS[part])
    match rng.integers(6):
        case 0:
            message.encoding = str(rng.choice(_FALSE_ENCODINGS))
        case 1:
            message.step = int(rng.integers(message.step))
        case 2:
            message.width = 2**32 - 1 - int(rng.integers(100))
        case 3:
            message.height = int(rng.choice([0, height + 1, 2**32 - 1]))
        case 4:
            message.data = message.data[: int(rng.integers(len(message.data)))]
        case 5:
            message.data = array.array("B", bytes(len(message.data) + 1 + int(rng.integers(1000))))
    return message


def false_frames(
    count: int, now_ns: int, rng: np.random.Generator
) -> Iterator[tuple[Scene, dict[str, Any]]]:
    """Scenes of nobody, each with images of one stamp that show noise, holes or nothing."""
    for number in range(count):
        stamp_ns = now_ns + number
        width, height = (int(side) for side in rng.choice([1, 7, 64, 320, 640], 2))
        color = _pixels("color", height, width, rng)
        depth = _pixels("depth", height, width, rng)
        depth[rng.random(depth.shape) < 0.5] = rng.choice([np.nan, np.inf, -1.0, 0.0, 1e30])
        instances = _pixels("instances", height, width, rng) % int(rng.choice([1, 5, 65535]))
        focal = float(rng.choice([1e-6, 1.0, 300.0, 1e12]))
        frame = Frame(stamp_ns, "fuzz", color, depth, Intrinsics(width, height, focal, focal, 0, 0))
        header = header_of(stamp_ns, "fuzz")
        objects = [KnownObject(instance=each + 1, name=f"false {each}") for each in range(4)]
        scene = Scene(
            stamp=Stamp.of(stamp_ns),
            scene_id=f"false-{number:04d}",
            mode="training",
            objects=objects,
        )
        yield (
            scene,
            {
                "color": image_message(header, frame.color, "rgb8"),
                "depth": image_message(header, frame.depth, "32FC1"),
                "camera_info": camera_info_message(header, frame.intrinsics),
                "instances": image_message(header, instances, "16UC1"),
            },
        )


def _pixels(part: str, height: int, width: int, rng: np.random.Generator) -> Any:
    if part == "color":
        return rng.integers(0, 256, (height, width, 3)).astype(np.uint8)
    if part == "depth":
        return rng.normal(1.0, 0.5, (height, width)).astype(np.float32)
    return rng.integers(0, 2**16, (height, width)).astype(np.uint16)
