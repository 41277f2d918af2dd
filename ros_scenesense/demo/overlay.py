"""What is drawn over the image of a scene: outlines of the objects, and names that do not collide.

Coordinates are those of SVG: a pixel is a unit square, (0, 0) the top left corner of the image.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

FONT_SIZE = 8.0
_TAG_HEIGHT = FONT_SIZE + 3.5
_PADDING = 3.0
_GAP = 2.0
_SPECK_AREA = 12.0
# What a tag costs: a pixel of another object 1, one of its own less; the distance to its own much.
_OWN_PIXEL = 0.33
_PIXEL_AWAY = 20.0


@dataclass(frozen=True)
class Outline:
    """Contours of one object as the data of an SVG path, and the corners of their box.

    Attributes:
        instance: Id of the object.
        path: SVG path data.
        left, top, right, bottom: Box around the object, pixels.
    """

    instance: int
    path: str
    left: float
    top: float
    right: float
    bottom: float


@dataclass(frozen=True)
class Tag:
    """Where the name of an object stands: a rectangle with the text in its middle."""

    left: float
    top: float
    width: float
    height: float = _TAG_HEIGHT

    @property
    def text_width(self) -> float:
        """Width that the text is fitted into, whatever font the reader has."""
        return round(self.width - 2 * _PADDING, 1)

    def overlap(self, other: Tag) -> float:
        """Area that two tags share."""
        width = min(self.left + self.width, other.left + other.width) - max(self.left, other.left)
        height = min(self.top + self.height, other.top + other.height) - max(self.top, other.top)
        return max(0.0, width) * max(0.0, height)


def outline(instances: npt.NDArray[np.uint16], instance: int) -> Outline | None:
    """The outline of one object.

    Args:
        instances: (H, W) instance ids.
        instance: The object's id.

    Returns:
        The outline, or None if nothing of the object is in the image.
    """
    rows, columns = np.nonzero(instances == instance)
    if rows.size == 0:
        return None
    top, left = max(0, rows.min() - 1), max(0, columns.min() - 1)
    mask = (instances[top : rows.max() + 2, left : columns.max() + 2] == instance).astype(np.uint8)
    contours = _smooth_contours(mask)
    largest = max(contours, key=cv2.contourArea)
    parts = [
        part.reshape(-1, 2) + np.array([left, top])
        for part in contours
        if part is largest or cv2.contourArea(part) >= _SPECK_AREA
    ]
    path = " ".join("M" + " ".join(f"{x:.4g},{y:.4g}" for x, y in part) + "Z" for part in parts)
    corners = np.concatenate(parts)
    (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
    return Outline(instance, path, float(left), float(top), float(right), float(bottom))


def _smooth_contours(mask: npt.NDArray[np.uint8]) -> list[npt.NDArray[np.float32]]:
    # Magnified before it is cut at one half, a slanting edge is a line and not a staircase.
    scale = 4
    padded = cv2.copyMakeBorder(mask * 255, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    large = cv2.resize(padded, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)
    contours, _ = cv2.findContours(
        (large > 127).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    simple = [cv2.approxPolyDP(contour, 0.9, True) for contour in contours]
    return [((part + 0.5) / scale - 1.0).astype(np.float32) for part in simple]


def place_tags(
    outlines: Mapping[str, Outline],
    instances: npt.NDArray[np.uint16],
    character_width: float = 0.6,
) -> dict[str, Tag]:
    """Places the name of each object beside its outline.

    Every name takes the free place that covers least of the objects, the smallest objects
    choosing first. In a crowd that is a place on the object itself rather than on another one, or
    far from it.

    Args:
        outlines: By object name.
        instances: (H, W) instance ids.
        character_width: Of the font, as a share of `FONT_SIZE`.
    """
    placed: dict[str, Tag] = {}
    by_size = sorted(outlines, key=lambda name: (outlines[name].right - outlines[name].left, name))
    for name in by_size:
        own = instances == outlines[name].instance
        away = cv2.distanceTransform((~own).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_3)
        cost = np.where(own, _OWN_PIXEL, instances > 0)
        placed[name] = min(
            _candidates(outlines[name], len(name) * character_width * FONT_SIZE, instances.shape),
            key=lambda tag, cost=cost, away=away: (  # type: ignore[misc]
                sum(tag.overlap(other) for other in placed.values()),
                _under(tag, cost).sum() + _PIXEL_AWAY * _under(tag, away).min(),
            ),
        )
    return placed


def _candidates(outline: Outline, text_width: float, shape: tuple[int, ...]) -> list[Tag]:
    width = text_width + 2 * _PADDING
    middle = (outline.left + outline.right - width) / 2
    centre = (outline.top + outline.bottom - _TAG_HEIGHT) / 2
    above, below = outline.top - _TAG_HEIGHT - _GAP, outline.bottom + _GAP
    right, left = outline.right + _GAP, outline.left - width - _GAP
    corners = [(middle, above), (middle, below), (right, centre), (left, centre)]
    corners += [(right, above), (left, above), (right, below), (left, below)]
    corners += [(middle, centre)]
    height_px, width_px = shape[:2]
    tags = []
    for x, y in corners:
        clamped_x = min(max(x, 1.0), width_px - width - 1.0)
        clamped_y = min(max(y, 1.0), height_px - _TAG_HEIGHT - 1.0)
        tags.append(Tag(round(clamped_x, 1), round(clamped_y, 1), round(width, 1)))
    return tags


def _under(tag: Tag, image: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    """The pixels under a tag."""
    top, left = max(0, int(tag.top)), max(0, int(tag.left))
    return image[top : int(tag.top + tag.height) + 1, left : int(tag.left + tag.width) + 1]
