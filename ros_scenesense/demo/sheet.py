"""A contact sheet: scenes of a dataset with their labels, for the eye.

Stable objects have a green outline, unstable ones a red one, ambiguous ones a grey one; a filled
square says that the object is occluded, an empty one that this is ambiguous.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from ros_scenesense.demo.annotation import Image, draw_outline
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.engine import SimulatedScene


def draw_sheet(reader: DatasetReader, indices: Sequence[int]) -> Image:
    """The scenes of these numbers side by side, (H, W, 3) RGB."""
    tiles = [_tile(reader[index], index) for index in indices]
    columns = math.ceil(math.sqrt(len(tiles)))
    blank = np.full_like(tiles[0], 255)
    tiles += [blank] * (-len(tiles) % columns)
    rows = [np.hstack(tiles[first : first + columns]) for first in range(0, len(tiles), columns)]
    return np.vstack(rows)


_OUTLINES = {Truth.TRUE: (0, 170, 0), Truth.FALSE: (220, 0, 0), Truth.AMBIGUOUS: (110, 110, 110)}
_CAPTION_HEIGHT = 18
_MARGIN = 3


def _tile(scene: SimulatedScene, index: int) -> Image:
    image = scene.frame.color.copy()
    instances = scene.frame.instances
    assert instances is not None
    for known, label in zip(scene.objects, scene.object_labels, strict=True):
        mask = instances == known.instance
        draw_outline(image, mask, _OUTLINES[label.stable], width=1)
        rows, columns = np.nonzero(mask)
        if label.occluded is not Truth.FALSE and len(rows):
            x, y = int(columns.mean()), int(rows.mean())
            if label.occluded is Truth.TRUE:
                cv2.rectangle(image, (x - 3, y - 3), (x + 3, y + 3), (0, 0, 0), cv2.FILLED)
            cv2.rectangle(image, (x - 3, y - 3), (x + 3, y + 3), (255, 255, 255), 1)
    caption = np.full((_CAPTION_HEIGHT, image.shape[1], 3), 255, dtype=np.uint8)
    stack = max(scene.structure_labels, key=lambda label: len(label.members), default=None)
    words = f"{index} {scene.arrangement}"
    if stack is not None and len(stack.members) > 1:
        words += f": {len(stack.members)} stacked, stable {stack.stable}"
    cv2.putText(caption, words, (3, 13), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 0), 1, cv2.LINE_AA)
    tile = np.vstack([image, caption])
    edges = ((_MARGIN, _MARGIN), (_MARGIN, _MARGIN), (0, 0))
    return np.pad(tile, edges, constant_values=255)
