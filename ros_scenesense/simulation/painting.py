"""Textures: images that are read, and ones painted in the colour that an object has in a scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import SimulationError
from ros_scenesense.simulation.meshes import CELLS, STRIP
from ros_scenesense.simulation.object_files import MarkSpec

Image = npt.NDArray[np.uint8]

WIDTH = 256
HEIGHT = 128
LARGEST = 512


def paint(
    color: tuple[float, float, float], marks: Sequence[MarkSpec], plain: Sequence[str | None]
) -> Image:
    """A texture (HEIGHT, WIDTH, 3) RGB: the unrolled outer wall, beside it a strip of plain cells.

    Args:
        color: The object's own, 0 to 1.
        marks: Patches on the wall; later ones cover earlier ones.
        plain: Colours of the cells 1, ...; None = the object's own.
    """
    own = np.round(np.array(color) * 255.0).astype(np.uint8)
    image = np.tile(own, (HEIGHT, WIDTH, 1))
    strip = round(STRIP * WIDTH)
    cell = HEIGHT // CELLS
    for number, name in enumerate(plain, 1):
        if name is not None:
            # Images begin at the top, texture coordinates at the bottom.
            image[HEIGHT - (number + 1) * cell : HEIGHT - number * cell, :strip] = _rgb(name)
    for mark in marks:
        left, right = (strip + round(share * (WIDTH - strip)) for share in sorted(mark.around))
        bottom, top = (HEIGHT - round(share * HEIGHT) for share in sorted(mark.up))
        image[top:bottom, left:right] = _rgb(mark.color)
    return image


def read_texture(path: Path) -> Image:
    """An image file as (H, W, 3) RGB, at most LARGEST pixels wide and high.

    Raises:
        SimulationError: If the file is no image.
    """
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise SimulationError(f"texture {path} cannot be read: it must be a PNG or JPEG image")
    scale = LARGEST / max(image.shape[:2])
    if scale < 1.0:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(image[..., ::-1], dtype=np.uint8)


def write_png(path: Path, image: Image) -> None:
    """Writes an RGB image (H, W, 3) for Bullet to read.

    Raises:
        SimulationError: If it cannot be written.
    """
    if not cv2.imwrite(str(path), np.ascontiguousarray(image[..., ::-1])):
        raise SimulationError(f"texture {path} cannot be written: is the disk full?")


def _rgb(name: str) -> list[int]:
    return list(bytes.fromhex(name.removeprefix("#")))
