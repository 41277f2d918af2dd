"""A contact sheet: scenes of a dataset with their labels, for the eye.

Stable objects have a green outline, unstable ones a red one, ambiguous ones a grey one; a filled
square says that the object is occluded, an empty one that this is ambiguous.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import DatasetError, ParameterError
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.engine import SimulatedScene

Image = npt.NDArray[np.uint8]


def choose(reader: DatasetReader, count: int, arrangement: str | None = None) -> list[int]:
    """Numbers of at most so many scenes, spread evenly over the dataset.

    Raises:
        ParameterError: If there is none of the arrangement.
    """
    kinds = [record.arrangement for record in reader.records()]
    numbers = [i for i, kind in enumerate(kinds) if arrangement in (None, kind)]
    if not numbers:
        raise ParameterError(
            f"--arrangement is {arrangement!r}, the dataset has {', '.join(sorted(set(kinds)))}"
        )
    count = min(count, len(numbers))
    return [numbers[i * len(numbers) // count] for i in range(count)]


def draw_sheet(reader: DatasetReader, indices: Sequence[int]) -> Image:
    """The scenes of these numbers side by side, (H, W, 3) RGB."""
    tiles = [_tile(reader[index], index) for index in indices]
    columns = math.ceil(math.sqrt(len(tiles)))
    blank = np.full_like(tiles[0], 255)
    tiles += [blank] * (-len(tiles) % columns)
    rows = [np.hstack(tiles[first : first + columns]) for first in range(0, len(tiles), columns)]
    return np.vstack(rows)


def write_sheet(sheet: Image, path: Path) -> None:
    """Writes an image (H, W, 3) RGB as PNG.

    Raises:
        DatasetError: If it cannot be written.
    """
    _, content = cv2.imencode(".png", np.ascontiguousarray(sheet[..., ::-1]))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.tobytes())
    except OSError as error:
        raise DatasetError(f"'{path}' cannot be written: {error.strerror}") from error


_OUTLINES = {Truth.TRUE: (0, 170, 0), Truth.FALSE: (220, 0, 0), Truth.AMBIGUOUS: (110, 110, 110)}
_CAPTION_HEIGHT = 18
_MARGIN = 3


def _tile(scene: SimulatedScene, index: int) -> Image:
    image = scene.frame.color.copy()
    instances = scene.frame.instances
    assert instances is not None
    for known, label in zip(scene.objects, scene.object_labels, strict=True):
        mask = (instances == known.instance).astype(np.uint8)
        outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(image, outlines, -1, (255, 255, 255), 3)
        cv2.drawContours(image, outlines, -1, _OUTLINES[label.stable], 1)
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
