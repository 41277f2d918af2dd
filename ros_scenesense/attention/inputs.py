"""What the networks are shown: pixels of a region or an image, scaled to the network's size."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Sequence

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.outline import Outline
from ros_scenesense.attention.regions import crop
from ros_scenesense.errors import NetworkError
from ros_scenesense.messages.attention import Roi
from ros_scenesense.scene import Frame

_DEPTH_RANGE_M = 0.3
"""Depth is shown relative to the target, up to so far before and behind it."""


def query_image(
    frame: Frame,
    instances: npt.NDArray[np.uint16],
    roi: Roi,
    target: int,
    related: Collection[int],
    side: int,
) -> npt.NDArray[np.float32]:
    """A region with one object marked: the input of a query network.

    Args:
        frame: Colour and depth.
        instances: (H, W) instance ids.
        roi: The region.
        target: Instance id of the object in question.
        related: Instance ids of the objects that it stands in a relevant relation to.
        side: Pixels of the result.

    Returns:
        (6, side, side): red, green, blue from 0 to 1; depth behind (positive) or before the target
        from -1 to 1, 0 where nothing was read; mask of the target; mask of the related objects. The
        region keeps its proportions; what is missing to a square is 0.

    Raises:
        NetworkError: If the region is not in the image, or shows nothing of the target.
    """
    try:
        color, depth, ids = crop(frame.color, roi), crop(frame.depth, roi), crop(instances, roi)
    except ValueError as error:
        raise NetworkError(str(error)) from error
    mask = ids == target
    if not mask.any():
        raise NetworkError(f"the region shows no pixel of instance {target}, which it is about")
    read = np.isfinite(depth) & (depth > 0.0)
    seen = mask & read
    # A target without any reading: depth tells nothing.
    middle = float(np.median(depth[seen])) if seen.any() else np.nan
    with np.errstate(invalid="ignore"):
        behind = np.clip((depth - middle) / _DEPTH_RANGE_M, -1.0, 1.0)
    behind = np.where(read & np.isfinite(behind), behind, 0.0).astype(np.float32)
    near = np.isin(ids, [*related])
    return _scaled([color, behind, mask.astype(np.float32), near.astype(np.float32)], side)


def color_image(
    color: npt.NDArray[np.uint8], side: int, roi: Roi | None = None
) -> npt.NDArray[np.float32]:
    """A whole image, or a region of it, (3, side, side) from 0 to 1: what LeNet and AlexNet get.

    Raises:
        NetworkError: If the region is not in the image.
    """
    try:
        pixels = color if roi is None else crop(color, roi)
    except ValueError as error:
        raise NetworkError(str(error)) from error
    return _scaled([pixels], side)


NUMBERS = 6
"""Numbers beside the image of a query."""
_EXACT_M = 0.005
"""About as exactly overhangs are measured; far beyond and far within, all are the same."""


def query_numbers(overhang: float | None, outline: Outline) -> npt.NDArray[np.float32]:
    """The numbers beside the image of a query, (6,).

    Args:
        overhang: Metres, see `overhang.overhangs`; None of what stands on no object.
        outline: What is nearer along the outline.

    Returns:
        Overhang from -1, far within the area of contact, through 0 on its edge to 1, -1 if there is
        none; 1 if there is one, else 0; shares of the outline where something nearer begins: above
        of related objects and of others, below of related objects and of others.
    """
    leans = [-1.0, 0.0] if overhang is None else [float(np.tanh(overhang / _EXACT_M)), 1.0]
    nearer = [
        outline.upper_related,
        outline.upper_other,
        outline.lower_related,
        outline.lower_other,
    ]
    return np.array([*leans, *nearer], np.float32)


def pack(image: npt.NDArray[np.float32]) -> bytes:
    """An input of a query network as bytes for keeping, with 256 steps per channel."""
    steps = np.rint((image + _offset(image)) * _steps(image)).astype(np.uint8)
    return zlib.compress(steps.tobytes(), level=1)


def unpack(content: bytes, side: int) -> npt.NDArray[np.float32]:
    """The input (6, side, side) that `pack` made bytes of.

    Raises:
        NetworkError: If the bytes are no such input.
    """
    try:
        steps = np.frombuffer(zlib.decompress(content), np.uint8).reshape(-1, side, side)
    except (zlib.error, ValueError) as error:
        raise NetworkError(f"an example is damaged, or not of {side} pixels: {error}") from error
    image = steps.astype(np.float32)
    return image / _steps(image) - _offset(image)


def _offset(image: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """What makes each channel start at 0: the depth, in fourth place, starts at -1."""
    return np.array([0, 0, 0, 1, 0, 0], np.float32)[: len(image), None, None]


def _steps(image: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    return np.array([255, 255, 255, 127, 255, 255], np.float32)[: len(image), None, None]


def _scaled(planes: Sequence[npt.NDArray[np.generic]], side: int) -> npt.NDArray[np.float32]:
    """Images (H, W) or (H, W, C) of one size as (sum of C, side, side), in the middle of a square.

    Bytes become 0 to 1.
    """
    height, width = planes[0].shape[:2]
    longer = max(height, width)
    size = (max(1, round(side * width / longer)), max(1, round(side * height / longer)))
    how = cv2.INTER_AREA if longer > side else cv2.INTER_LINEAR
    left, top = (side - size[0]) // 2, (side - size[1]) // 2
    channels = sum(1 if plane.ndim == 2 else plane.shape[2] for plane in planes)
    square = np.zeros((channels, side, side), np.float32)
    first = 0
    for plane in planes:
        scaled = cv2.resize(np.ascontiguousarray(plane), size, interpolation=how)
        scaled = scaled.reshape(size[1], size[0], -1).transpose(2, 0, 1)
        if plane.dtype == np.uint8:
            scaled = scaled / np.float32(255.0)
        square[first : first + len(scaled), top : top + size[1], left : left + size[0]] = scaled
        first += len(scaled)
    return square
