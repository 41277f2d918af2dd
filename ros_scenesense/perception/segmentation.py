"""Finds the objects on a table in an RGB-D frame that comes without instance ids.

The table's plane is found, what rises from it cut into pieces that are surely of one object each
(`regions`), and these put together (`merging`). Objects are what stands over the visible table:
walls and chairs beside it are none. See docs/perception.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Float, Intrinsics
from ros_scenesense.perception.merging import merged
from ros_scenesense.perception.plane import Plane, find_table
from ros_scenesense.perception.points import points_of
from ros_scenesense.perception.regions import Pieces, cut
from ros_scenesense.perception.surface import Image, Labels, Mask, Surface, measure_surface
from ros_scenesense.perception.tabletop import Tabletop, measure_tabletop

Instances = npt.NDArray[np.uint16]
Window = tuple[slice, slice]


@dataclass(frozen=True, eq=False)
class Found:
    """What was found in a frame.

    Attributes:
        instances: (H, W) uint16, objects from 1 on, from left to right; 0 = background.
        plane: The table top; None if there is none.
        wrong: Why nothing could be looked for; None if it could.
    """

    instances: Instances
    plane: Plane | None
    wrong: str | None = None


def find_objects(
    color: npt.NDArray[np.uint8],
    depth: Image,
    intrinsics: Intrinsics,
    rng: np.random.Generator,
    up: Float | None = None,
) -> Found:
    """Finds the objects on the table.

    Args:
        color: (H, W, 3) RGB.
        depth: (H, W) metres along the optical axis; 0 or NaN where nothing was read.
        intrinsics: Of both images.
        rng: Draws the samples that the table is found and measured with.
        up: (3,) direction against gravity in the optical frame; None if unknown.

    Raises:
        FrameError: If the images are not of the camera's size.
    """
    size = (intrinsics.height, intrinsics.width)
    if color.shape[:2] != size or depth.shape != size:
        raise FrameError(
            f"colour is {color.shape[:2]}, depth {depth.shape}, the camera {size} (rows, columns): "
            "give aligned images of one size"
        )
    scale = _scale(intrinsics)
    small_color, small_depth, camera = _scaled(color, depth, intrinsics, scale)
    points = points_of(small_depth, camera)
    flat = points.reshape(-1, 3)
    read = np.flatnonzero(np.isfinite(flat[:, 2]))
    nothing = np.zeros(depth.shape, dtype=np.uint16)
    if len(read) == 0:
        return Found(nothing, None, "no pixel of the depth image has a reading")
    sample = flat[read[rng.integers(len(read), size=_TABLE_SAMPLE)]].astype(np.float64)
    plane = find_table(sample, rng, up)
    if plane is None:
        return Found(nothing, None, _NO_TABLE)
    if up is None and plane.normal[2] < -math.cos(math.radians(_FACES_DEG)):
        return Found(nothing, plane, _FACING)
    tabletop = measure_tabletop(points, plane, rng)
    outlook = look(small_color, small_depth, camera, tabletop)
    if outlook is None:
        return Found(nothing, plane)
    labels = _labels(outlook, tabletop)
    if scale != 1.0:
        height, width = depth.shape
        labels = cv2.resize(
            labels.astype(np.uint16), (width, height), interpolation=cv2.INTER_NEAREST
        ).astype(np.int32)
    return Found(_numbered(labels), plane)


_NO_TABLE = (
    "no table plane was found: a tenth of the depth readings must lie on one level plane; show "
    "more of the table, or publish instance ids (16UC1, 0 = background) on camera/instances"
)
_FACING = (
    "the largest plane faces the camera: that may be a table seen from straight above, a wall, or "
    "an object that fills the image; publish camera_pose in scene, which tells where up is, or "
    "instance ids on camera/instances"
)
_FACES_DEG = 10.0
_TABLE_SAMPLE = 4000
# Sizes in pixels are meant for this focal length; images are scaled by 2 or 1/2 to come near it.
_FOCAL = 600.0
_MARGIN = 12
# An object has at least so many pixels, in the scaled image.
_LEAST_PIXELS = 120
_LEAST_SHARE_OVER_TABLE = 0.5
# What looks like the table around it is only believed to be an object from this height on, times
# the height from which a pixel is not of the table.
_CLEARLY_HIGHER = 2.0
_LOOKS_THE_SAME = 8.0
_AROUND = np.ones((15, 15), dtype=np.uint8)
_NEIGHBOURS = np.ones((3, 3), dtype=np.uint8)
_LOOK_ROUND = 8
# Less of an object may be without a reading, or no higher than the table.
_LEAST_SHARE_RISING = 0.3
# What is no object of its own is of a neighbour whose colour differs less.
_ALIKE = 20.0
# So small a part of a neighbour that so much of its outline borders on is of this, if alike.
_SMALL_PART = 0.1
_MOSTLY = 0.5
_SURELY_LOWER_M = -0.02


def _scale(intrinsics: Intrinsics) -> float:
    if intrinsics.fx < _FOCAL / 1.5:
        return 2.0
    return 0.5 if intrinsics.fx > _FOCAL * 1.5 else 1.0


def _scaled(
    color: npt.NDArray[np.uint8], depth: Image, intrinsics: Intrinsics, scale: float
) -> tuple[npt.NDArray[np.uint8], Image, Intrinsics]:
    if scale == 1.0:
        return color, depth, intrinsics
    width, height = round(intrinsics.width * scale), round(intrinsics.height * scale)
    how = cv2.INTER_LINEAR if scale > 1.0 else cv2.INTER_AREA
    camera = Intrinsics(
        width,
        height,
        intrinsics.fx * width / intrinsics.width,
        intrinsics.fy * height / intrinsics.height,
        # A pixel's integer coordinates are its centre.
        (intrinsics.cx + 0.5) * width / intrinsics.width - 0.5,
        (intrinsics.cy + 0.5) * height / intrinsics.height - 0.5,
    )
    return (
        np.asarray(cv2.resize(color, (width, height), interpolation=how), dtype=np.uint8),
        np.asarray(
            cv2.resize(depth, (width, height), interpolation=cv2.INTER_NEAREST), dtype=np.float32
        ),
        camera,
    )


@dataclass(frozen=True, eq=False)
class Outlook:
    """The part of an image that holds the objects, cut into pieces.

    Attributes:
        window: Where in the image it is.
        rising: (h, w) pixels that are of something on the table.
        surface: Of the part.
        pieces: Of the part.
    """

    window: Window
    rising: Mask
    surface: Surface
    pieces: Pieces


def look(
    color: npt.NDArray[np.uint8], depth: Image, intrinsics: Intrinsics, tabletop: Tabletop
) -> Outlook | None:
    """Cuts what rises from the table into pieces; None if nothing does."""
    rising = tabletop.rising
    rows, columns = np.flatnonzero(rising.any(axis=1)), np.flatnonzero(rising.any(axis=0))
    if len(rows) == 0:
        return None
    row, column = max(0, int(rows[0]) - _MARGIN), max(0, int(columns[0]) - _MARGIN)
    window = np.s_[row : int(rows[-1]) + 1 + _MARGIN, column : int(columns[-1]) + 1 + _MARGIN]
    part = np.nan_to_num(depth[window], nan=0.0, posinf=0.0, neginf=0.0)
    read = part > 0.0
    surface = measure_surface(color[window], np.maximum(part, 0.0), intrinsics, row, column)
    with np.errstate(invalid="ignore"):
        lower = tabletop.heights[window] < _SURELY_LOWER_M
    pieces = cut(surface, rising[window], read, lower)
    return Outlook(window, rising[window], surface, pieces)


def _labels(outlook: Outlook, tabletop: Tabletop) -> Labels:
    """The objects (H, W) by any numbers from 1 on."""
    surface, pieces, window = outlook.surface, outlook.pieces, outlook.window
    objects = merged(pieces, surface)[pieces.labels]
    sizes = np.bincount(objects.ravel())
    place = _Place(objects, sizes, outlook.rising, tabletop, surface, window)
    becomes = np.arange(len(sizes), dtype=np.int32)
    for label, box in enumerate(ndimage.find_objects(objects), 1):
        if box is not None:
            owner = becomes[_judged(label, box, place)]
            # Whoever was taken to be of this one goes where it goes.
            becomes[becomes == label] = owner
    whole = np.zeros(tabletop.heights.shape, dtype=np.int32)
    whole[window] = becomes[objects]
    return whole


@dataclass(frozen=True, eq=False)
class _Place:
    """The part of the image that holds the objects.

    Attributes:
        objects: (h, w) labels of the objects.
        sizes: Pixels of each label.
        rising: (h, w) pixels that are of something on the table.
        tabletop: Everything relative to the table, in the whole image.
        surface: Of the part.
        window: Where in the image it is.
    """

    objects: Labels
    sizes: npt.NDArray[np.intp]
    rising: Mask
    tabletop: Tabletop
    surface: Surface
    window: Window


def _judged(label: int, box: Window, place: _Place) -> int:
    """The label of the object that something is of: its own, a neighbour's, or 0.

    A splinter is of its neighbour, and what is beside the table is no object.
    """
    rows, columns = box
    around = np.s_[
        max(0, rows.start - _LOOK_ROUND) : rows.stop + _LOOK_ROUND,
        max(0, columns.start - _LOOK_ROUND) : columns.stop + _LOOK_ROUND,
    ]
    labels, lab = place.objects[around], place.surface.lab[around]
    mine = labels == label
    rising = mine & place.rising[around]
    count = np.count_nonzero(rising)
    beside = cv2.dilate(mine.view(np.uint8), _NEIGHBOURS).view(np.bool_) & ~mine
    color = lab[mine].mean(axis=0)
    owner, share = _neighbour(labels[beside], lab[beside], color)
    area = np.count_nonzero(mine)
    if count < max(_LEAST_PIXELS, _LEAST_SHARE_RISING * area):
        return owner
    if owner and share > _MOSTLY and area < _SMALL_PART * place.sizes[owner]:
        return owner
    heights = place.tabletop.heights[place.window][around][rising]
    least = place.tabletop.least[place.window][around][rising]
    y, x = np.nonzero(rising)
    y += place.window[0].start + around[0].start
    x += place.window[1].start + around[1].start
    if place.tabletop.share_over(y, x) < _LEAST_SHARE_OVER_TABLE:
        return 0
    if np.percentile(heights - _CLEARLY_HIGHER * least, 90.0) <= 0.0:
        ring = cv2.dilate(mine.view(np.uint8), _AROUND).view(np.bool_) & (labels == 0)
        if ring.any() and np.linalg.norm(color - lab[ring].mean(axis=0)) <= _LOOKS_THE_SAME:
            return 0
    return label


def _neighbour(labels: Labels, lab: Image, color: Float) -> tuple[int, float]:
    """Whom most of the pixels beside something of a colour belong to, and their share.

    Args:
        labels: (N,) of the pixels beside it.
        lab: (N, 3) their colours.
        color: (3,) of what they are beside.

    Returns:
        0 if nobody is there, or if its colour is another one.
    """
    neighbours = labels[labels > 0]
    if len(neighbours) == 0:
        return 0, 0.0
    label = int(np.bincount(neighbours).argmax())
    theirs = labels == label
    alike = np.linalg.norm(lab[theirs].mean(axis=0) - color) < _ALIKE
    return (label, float(np.mean(theirs))) if alike else (0, 0.0)


def _numbered(labels: Labels) -> Instances:
    """The same objects, numbered from left to right by their middles."""
    rows, columns = np.nonzero(labels)
    owners = labels[rows, columns]
    sizes = np.bincount(owners, minlength=1)
    middles = np.bincount(owners, columns, minlength=1) / np.maximum(sizes, 1)
    present = np.flatnonzero(sizes[1:]) + 1
    order = present[np.argsort(middles[present], kind="stable")]
    number = np.zeros(len(sizes), dtype=np.uint16)
    number[order] = np.arange(1, len(order) + 1)
    return number[labels]
