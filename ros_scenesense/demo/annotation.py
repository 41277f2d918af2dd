"""Draws over an image what is known of its objects: outlines, and names that do not collide."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.demo.overlay import Outline, Tag, outline, place_tags
from ros_scenesense.errors import SceneSenseError

Image = npt.NDArray[np.uint8]
Color = tuple[int, int, int]

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_CHARACTER_WIDTH = 0.46
_DRAWN_WIDTH = 960
_WIDEST_WITHOUT_LOSS = 720


@dataclass(frozen=True)
class Note:
    """What is written at an object.

    Attributes:
        instance: Its id in the instance image.
        words: The text.
        color: RGB of its outline and of the text.
    """

    instance: int
    words: str
    color: Color


@dataclass(frozen=True)
class Rectangle:
    """A rectangle in the image, pixels of the image, and the RGB of its line."""

    left: int
    top: int
    width: int
    height: int
    color: Color


def annotate(
    color: Image,
    instances: npt.NDArray[np.uint16],
    notes: Iterable[Note],
    rectangles: Iterable[Rectangle] = (),
) -> Image:
    """The colour image, enlarged to about 1,000 pixels a row, with notes at its objects.

    Args:
        color: (H, W, 3) RGB.
        instances: (H, W) instance ids.
        notes: What to write; of an object that no pixel shows nothing is drawn.
        rectangles: Drawn below what is written.

    Returns:
        (s H, s W, 3) RGB.
    """
    given_width = instances.shape[1]
    color, instances = _reduced(color, instances)
    height, width = instances.shape
    scale = max(2, round(_DRAWN_WIDTH / width))
    image: Image = cv2.resize(
        color, (scale * width, scale * height), interpolation=cv2.INTER_CUBIC
    ).astype(np.uint8)
    outlines: dict[str, Outline] = {}
    colors: dict[str, Color] = {}
    for note in notes:
        found = outline(instances, note.instance)
        if found is None:
            continue
        # Two notes of the same words keep a tag each.
        words = note.words if note.words not in outlines else f"{note.words} #{note.instance}"
        outlines[words], colors[words] = found, note.color
        draw_outline(image, instances == note.instance, note.color)
    for rectangle in rectangles:
        _draw_rectangle(image, rectangle, image.shape[1] / given_width)
    for words, tag in place_tags(outlines, instances, _CHARACTER_WIDTH).items():
        _draw_tag(image, tag, words, colors[words], scale)
    return image


def draw_outline(image: Image, mask: npt.NDArray[np.bool_], color: Color, width: int = 2) -> None:
    """Draws the outline of a mask over an image, with a white seam.

    Args:
        image: (s H, s W, 3) RGB, drawn on.
        mask: (H, W).
        color: RGB.
        width: Of the line in pixels.
    """
    size = (image.shape[1], image.shape[0])
    large = cv2.resize(mask.astype(np.uint8) * 255, size, interpolation=cv2.INTER_LINEAR)
    contours, _ = cv2.findContours(
        (large > 127).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    cv2.drawContours(image, contours, -1, (255, 255, 255), width + 2, cv2.LINE_AA)
    cv2.drawContours(image, contours, -1, color, width, cv2.LINE_AA)


def write_picture(image: Image, path: Path) -> None:
    """Writes an image (H, W, 3) RGB as PNG.

    Raises:
        SceneSenseError: If it cannot be written.
    """
    _, content = cv2.imencode(".png", np.ascontiguousarray(image[..., ::-1]))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.tobytes())
    except OSError as error:
        raise SceneSenseError(f"'{path}' cannot be written: {error.strerror}") from error


def surely(probability: float) -> str:
    """How probable a decision is, in per cent; no network is ever certain."""
    return ">99%" if probability > 0.99 else f"{probability:.0%}"


def _draw_rectangle(image: Image, rectangle: Rectangle, scale: float) -> None:
    corner = round(scale * rectangle.left), round(scale * rectangle.top)
    right, bottom = rectangle.left + rectangle.width, rectangle.top + rectangle.height
    opposite = round(scale * right), round(scale * bottom)
    cv2.rectangle(image, corner, opposite, rectangle.color, 2, cv2.LINE_AA)


def _reduced(
    color: Image, instances: npt.NDArray[np.uint16]
) -> tuple[Image, npt.NDArray[np.uint16]]:
    """Images of high resolution made smaller: names are as large as pixels make them."""
    height, width = instances.shape
    step = -(-width // _WIDEST_WITHOUT_LOSS)
    if step == 1:
        return color, instances
    size = (-(-width // step), -(-height // step))
    small: Image = cv2.resize(color, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    return small, np.ascontiguousarray(instances[::step, ::step])


def _draw_tag(image: Image, tag: Tag, words: str, color: Color, scale: int) -> None:
    left, top = round(scale * tag.left), round(scale * tag.top)
    right, bottom = round(scale * (tag.left + tag.width)), round(scale * (tag.top + tag.height))
    cv2.rectangle(image, (left, top), (right, bottom), (255, 255, 255), cv2.FILLED)
    cv2.rectangle(image, (left, top), (right, bottom), color, 1)
    (width, height), _ = cv2.getTextSize(words, _FONT, 1.0, 2)
    size = min(scale * tag.text_width / width, 0.6 * (bottom - top) / height)
    origin = (
        round((left + right - size * width) / 2),
        round((top + bottom + size * height) / 2),
    )
    cv2.putText(image, words, origin, _FONT, size, color, max(1, round(scale / 1.5)), cv2.LINE_AA)
