"""The frame as a picture: masks, outlines coloured by stability, names, and what was decided."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.demo.annotation import Color, Image, Note, annotate
from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.perceive.run import Report
from ros_scenesense.perceive.words import by_weight, decision, described, relation
from ros_scenesense.scene import Frame

_STABLE: dict[bool | None, Color] = {
    True: (0, 130, 0),
    False: (205, 0, 0),
    None: (90, 90, 90),
}
_MASK_SHARE = 0.25
_PANEL_WIDTH = 620
_LINE_HEIGHT = 25
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_INK = (20, 20, 20)


def draw(frame: Frame, instances: npt.NDArray[np.uint16], report: Report) -> Image:
    """The picture, RGB: the masked frame on the left, decisions and relations on the right.

    Args:
        frame: The images.
        instances: (H, W) instance ids that the report speaks of.
        report: What was found.
    """
    stable = {one.name: one.stable for one in report.decisions}
    notes = [
        Note(one.instance, one.name, _color_of(stable.get(one.name))) for one in report.objects
    ]
    picture = annotate(_masked(frame.color, instances), instances, notes)
    return np.asarray(np.hstack([picture, _panel(picture.shape[0], report)]), np.uint8)


def _color_of(belief: Belief | None) -> Color:
    return _STABLE[None if belief is None else belief.value]


def _masked(color: Image, instances: npt.NDArray[np.uint16]) -> Image:
    """Every object under a veil of a colour of its own."""
    tints = np.zeros((int(instances.max()) + 1, 3))
    for number, instance in enumerate(np.unique(instances[instances > 0])):
        # The golden ratio keeps the hues of neighbours in the list far apart.
        tints[instance] = np.array(colorsys.hsv_to_rgb(number * 0.618 % 1.0, 0.9, 1.0)) * 255.0
    veiled = (1.0 - _MASK_SHARE) * color + _MASK_SHARE * tints[instances]
    return np.where((instances > 0)[..., None], veiled, color).astype(np.uint8)


def _panel(height: int, report: Report) -> Image:
    """The lines beside the picture; what has no room is counted."""
    lines: list[tuple[str, Color]] = []
    objects = {one.name: described(one) for one in report.objects}
    for one in report.decisions:
        stable = decision(one.stable, "stable", "unstable")
        occluded = decision(one.occluded, "occluded", "visible")
        words = f"{objects[one.name]}: {stable}, {occluded}"
        lines.append((words, _color_of(one.stable)))
    lines.append(("", _INK))
    lines += [(relation(one), _INK) for one in by_weight(report)]
    room = height // _LINE_HEIGHT - 1
    if len(lines) > room:
        more = len(lines) - room + 1
        lines = [*lines[: room - 1], (f"... and {more} more lines in the JSON file", _INK)]
    panel = np.full((height, _PANEL_WIDTH, 3), 255, np.uint8)
    for number, (words, color) in enumerate(lines, start=1):
        (width, _), _ = cv2.getTextSize(words, _FONT, 1.0, 1)
        scale = min(0.55, (_PANEL_WIDTH - 20) / max(width, 1))
        cv2.putText(panel, words, (10, number * _LINE_HEIGHT), _FONT, scale, color, 1, cv2.LINE_AA)
    return panel
