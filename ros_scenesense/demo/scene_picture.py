"""A scene as a picture for the eye: outlines coloured by stability, names, who is hidden."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.demo.overlay import Outline, Tag, outline, place_tags
from ros_scenesense.errors import SimulationError
from ros_scenesense.messages.scenes import ObjectLabel
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.engine import SimulatedScene

Image = npt.NDArray[np.uint8]

_SCALE = 3
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_COLORS = {Truth.TRUE: (0, 150, 0), Truth.FALSE: (210, 0, 0), Truth.AMBIGUOUS: (90, 90, 90)}


def draw_scene(scene: SimulatedScene) -> Image:
    """The colour image, three times as large, with what is known, (3 H, 3 W, 3) RGB.

    Outline and name of a stable object are green, of an unstable one red, of an ambiguous one grey.
    Behind the name of an object that is not fully visible stands how much of it is hidden.
    """
    instances = scene.frame.instances
    assert instances is not None
    height, width = instances.shape
    image: Image = cv2.resize(
        scene.frame.color, (_SCALE * width, _SCALE * height), interpolation=cv2.INTER_CUBIC
    ).astype(np.uint8)
    outlines: dict[str, Outline] = {}
    colors: dict[str, tuple[int, int, int]] = {}
    for known, label in zip(scene.objects, scene.object_labels, strict=True):
        found = outline(instances, known.instance)
        if found is None:
            continue
        words = _words(label)
        outlines[words], colors[words] = found, _COLORS[label.stable]
        _draw_outline(image, instances == known.instance, colors[words])
    for words, tag in place_tags(outlines, instances).items():
        _draw_tag(image, tag, words, colors[words])
    return image


def write_picture(image: Image, path: Path) -> None:
    """Writes an image (H, W, 3) RGB as PNG.

    Raises:
        SimulationError: If it cannot be written.
    """
    _, content = cv2.imencode(".png", np.ascontiguousarray(image[..., ::-1]))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.tobytes())
    except OSError as error:
        raise SimulationError(f"'{path}' cannot be written: {error.strerror}") from error


def _words(label: ObjectLabel) -> str:
    if label.occluded is Truth.FALSE or label.visible_fraction is None:
        return label.name
    return f"{label.name} -{round(100 * (1 - label.visible_fraction))}%"


def _draw_outline(image: Image, mask: npt.NDArray[np.bool_], color: tuple[int, int, int]) -> None:
    size = (image.shape[1], image.shape[0])
    large = cv2.resize(mask.astype(np.uint8) * 255, size, interpolation=cv2.INTER_LINEAR)
    contours, _ = cv2.findContours(
        (large > 127).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    cv2.drawContours(image, contours, -1, (255, 255, 255), 4, cv2.LINE_AA)
    cv2.drawContours(image, contours, -1, color, 2, cv2.LINE_AA)


def _draw_tag(image: Image, tag: Tag, words: str, color: tuple[int, int, int]) -> None:
    left, top = round(_SCALE * tag.left), round(_SCALE * tag.top)
    right, bottom = round(_SCALE * (tag.left + tag.width)), round(_SCALE * (tag.top + tag.height))
    cv2.rectangle(image, (left, top), (right, bottom), (255, 255, 255), cv2.FILLED)
    cv2.rectangle(image, (left, top), (right, bottom), color, 1)
    (width, height), _ = cv2.getTextSize(words, _FONT, 1.0, 2)
    scale = min(_SCALE * tag.text_width / width, 0.6 * (bottom - top) / height)
    origin = (
        round((left + right - scale * width) / 2),
        round((top + bottom + scale * height) / 2),
    )
    cv2.putText(image, words, origin, _FONT, scale, color, 2, cv2.LINE_AA)
