"""Reads an RGB-D frame from files: a colour PNG, an aligned depth PNG, and the intrinsics.

Whatever is wrong with a file becomes one error that names the file and the mend.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import yaml

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Intrinsics
from ros_scenesense.perception.depth_units import unit_fault
from ros_scenesense.scene import Frame

FRAME_ID = "camera_color_optical_frame"
MILLIMETRES = 1000.0
"""Depth units per metre, where nothing else is said."""

_PNG = b"\x89PNG\r\n\x1a\n"
_LARGEST_SIDE = 8192


@dataclass(frozen=True)
class CameraFile:
    """What a file says of the camera.

    Attributes:
        fx, fy, cx, cy: Pinhole intrinsics in pixels.
        width, height: Size of the images; None where the file does not say.
        units_per_metre: Of the depth PNG; None where the file does not say.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int | None = None
    height: int | None = None
    units_per_metre: float | None = None

    def intrinsics(self, width: int, height: int) -> Intrinsics:
        """The intrinsics for images of a size.

        Raises:
            FrameError: If the file speaks of another size.
        """
        if (self.width or width, self.height or height) != (width, height):
            raise FrameError(
                f"the intrinsics are those of images of {self.width}x{self.height}, the colour "
                f"image has {width}x{height}: give the intrinsics of this image size"
            )
        return Intrinsics(width, height, self.fx, self.fy, self.cx, self.cy)


def read_frame(
    color: Path, depth: Path, intrinsics: Path, units_per_metre: float | None = None
) -> Frame:
    """The frame in a colour PNG and a depth PNG of one camera.

    Args:
        color: 8-bit PNG.
        depth: 16-bit PNG of the same size and viewpoint; 0 where nothing was read.
        intrinsics: File with the intrinsics, see `read_camera`.
        units_per_metre: Of the depth PNG; None = as the intrinsics file says, else millimetres.

    Raises:
        FrameError: If a file is missing or wrong, or if they do not fit together.
    """
    camera = read_camera(intrinsics)
    pixels = read_color(color)
    metres = read_depth(depth, units_per_metre or camera.units_per_metre or MILLIMETRES)
    height, width = pixels.shape[:2]
    if metres.shape != (height, width):
        raise FrameError(
            f"'{color}' has {width}x{height} pixels, '{depth}' {metres.shape[1]}x"
            f"{metres.shape[0]}: give the depth image that is aligned to the colour image"
        )
    return Frame(0, FRAME_ID, pixels, metres, camera.intrinsics(width, height))


def read_color(path: Path) -> npt.NDArray[np.uint8]:
    """Colour (H, W, 3) uint8 RGB from an 8-bit PNG, in grey or colour, alpha left out.

    Raises:
        FrameError: If it is missing or no such PNG.
    """
    pixels = read_png(path)
    if pixels.dtype != np.uint8:
        raise FrameError(
            f"'{path}' has 16 bits per channel: give the colour image as 8-bit PNG (is it the "
            "depth image?)"
        )
    conversion = {2: cv2.COLOR_GRAY2RGB, 3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGB}
    channels = 2 if pixels.ndim == 2 else pixels.shape[2]
    return np.asarray(cv2.cvtColor(pixels, conversion[channels]), np.uint8)


def read_depth(path: Path, units_per_metre: float = MILLIMETRES) -> npt.NDArray[np.float32]:
    """Depth (H, W) float32 metres from a 16-bit PNG; 0 where nothing was read.

    Args:
        path: The file.
        units_per_metre: What its numbers count; 1000 = millimetres.

    Raises:
        FrameError: If it is missing, no such PNG, without any reading, or clearly in other units.
    """
    pixels = read_png(path)
    if pixels.dtype != np.uint16 or pixels.ndim != 2:
        channels = 1 if pixels.ndim == 2 else pixels.shape[2]
        raise FrameError(
            f"'{path}' has {8 * pixels.itemsize} bits and {channels} channels: depth must be a "
            "16-bit PNG of one channel (a coloured or 8-bit depth picture holds no distances)"
        )
    if not pixels.any():
        raise FrameError(f"'{path}' has no depth reading at all: every pixel is 0")
    metres = (pixels.astype(np.float64) / units_per_metre).astype(np.float32)
    fault = unit_fault(metres)
    if fault is not None:
        raise FrameError(
            f"'{path}', read as {units_per_metre:g} units per metre: {fault}; say what the numbers "
            f"count with depth_scale in the intrinsics file{_suggestion(pixels)}"
        )
    return metres


def read_png(path: Path) -> npt.NDArray[Any]:
    """The pixels of a PNG as OpenCV gives them: (H, W) or (H, W, 3 or 4), blue first.

    Raises:
        FrameError: If the file is missing, unreadable, no PNG, damaged, or too large.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FrameError(f"'{path}' cannot be read: {error.strerror}") from error
    if not content.startswith(_PNG):
        raise FrameError(f"'{path}' is not a PNG file: colour and depth are read from PNG alone")
    # libpng would complain in its own words, and may take seconds for a header that is broken.
    if not _is_intact(content):
        raise FrameError(f"'{path}' is a damaged PNG file")
    width, height = (int.from_bytes(content[at : at + 4], "big") for at in (16, 20))
    if max(width, height) > _LARGEST_SIDE:
        raise FrameError(f"'{path}' has {width}x{height} pixels, more than {_LARGEST_SIDE} a side")
    try:
        pixels = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise FrameError(f"'{path}' cannot be decoded as PNG")
    return np.asarray(pixels)


def _is_intact(content: bytes) -> bool:
    """Whether the chunks of a PNG file follow each other to the end, with right checksums."""
    at, kind = len(_PNG), b""
    while kind != b"IEND":
        size = int.from_bytes(content[at : at + 4], "big")
        end = at + 8 + size
        if end + 4 > len(content):
            return False
        kind = content[at + 4 : at + 8]
        if at == len(_PNG) and kind != b"IHDR":
            return False
        if zlib.crc32(content[at + 4 : end]) != int.from_bytes(content[end : end + 4], "big"):
            return False
        at = end + 4
    return True


def read_camera(path: Path) -> CameraFile:
    """The intrinsics in a JSON or YAML file.

    Three layouts are known: `fx, fy, cx, cy` (with optional `width`, `height`, `depth_scale`); the
    same with `x_offset, y_offset` for the centre and `img_width, img_height` for the size; and a
    camera info as ROS prints it (`k` or `K`, or `camera_matrix: data`, each of nine numbers).

    `depth_scale` above 1 counts depth units per metre (1000), below 1 metres per unit (0.001).

    Raises:
        FrameError: If the file is missing, no JSON or YAML, or says no usable intrinsics.
    """
    document = _document(path)
    try:
        numbers = _pinhole(document)
        width, height = (_size(document, name) for name in ("width", "height"))
        scale = document.get("depth_scale")
        units = None if scale is None else units_per_metre_of(_number("depth_scale", scale))
    except ValueError as error:
        raise FrameError(f"intrinsics '{path}': {error}") from error
    return CameraFile(*numbers, width=width, height=height, units_per_metre=units)


def units_per_metre_of(depth_scale: float) -> float:
    """Depth units per metre; a scale below 1 is taken as metres per unit.

    Raises:
        ValueError: If it is not positive.
    """
    if not 0.0 < depth_scale < math.inf:
        raise ValueError(f"depth_scale is {depth_scale:g}, must be a number above 0")
    return depth_scale if depth_scale >= 1.0 else 1.0 / depth_scale


def _document(path: Path) -> Mapping[str, Any]:
    try:
        text = path.read_text()
        document = json.loads(text) if path.suffix == ".json" else next(yaml.safe_load_all(text))
    except (OSError, UnicodeError, ValueError, yaml.YAMLError, StopIteration) as error:
        words = error.strerror if isinstance(error, OSError) else " ".join(str(error).split())
        raise FrameError(f"intrinsics '{path}' cannot be read: {words}") from error
    if not isinstance(document, dict):
        raise FrameError(f"intrinsics '{path}' must hold names with numbers: fx, fy, cx, cy")
    return document


def _pinhole(document: Mapping[str, Any]) -> tuple[float, float, float, float]:
    matrix = document.get("k", document.get("K"))
    if matrix is None and isinstance(document.get("camera_matrix"), dict):
        matrix = document["camera_matrix"].get("data")
    if matrix is not None:
        if not isinstance(matrix, list) or len(matrix) != 9:
            raise ValueError("the matrix K must be a list of nine numbers")
        names = ["K[0]", "K[4]", "K[2]", "K[5]"]
        found = dict(zip(names, (matrix[0], matrix[4], matrix[2], matrix[5]), strict=True))
    else:
        found = {"fx": document.get("fx"), "fy": document.get("fy")}
        found["cx"] = document.get("cx", document.get("x_offset"))
        found["cy"] = document.get("cy", document.get("y_offset"))
    fx, fy, cx, cy = (_number(name, value) for name, value in found.items())
    if min(fx, fy) <= 0.0:
        raise ValueError(f"focal lengths are {fx:g} and {fy:g}, must be positive")
    return fx, fy, cx, cy


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        words = "is missing" if value is None else f"is {value!r:.40}, must be a number"
        raise ValueError(f"{name} {words}")
    return float(value)


def _size(document: Mapping[str, Any], name: str) -> int | None:
    keys = (name, f"img_{name}", f"image_{name}")
    value = next((document[key] for key in keys if key in document), None)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise ValueError(f"{name} is {value!r:.40}, must be a positive integer")
    return value


def _suggestion(pixels: npt.NDArray[np.uint16]) -> str:
    """The usual scale that puts the scene nearest to where tables stand."""
    median = float(np.median(pixels[pixels > 0]))
    usual = (1.0, 1000.0, 4000.0, 5000.0, 10_000.0)
    fitting = [scale for scale in usual if 0.2 <= median / scale <= 5.0]
    return f" ({fitting[0]:g} would fit)" if fitting else ""
