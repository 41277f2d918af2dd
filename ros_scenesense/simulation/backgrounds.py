"""Backgrounds: a procedural image for the table and one for the wall, and how they are put on.

A background is known by its number alone, so that a scene can be put before another one at any
time, without physics: the light on the table, shadows too, is what the picture has of it relative
to the colours of the old table. The colours are duller than those of objects.
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Float, Intrinsics, Pose, rotation_matrix
from ros_scenesense.scene import Frame

TABLE_COLOR = (0.45, 0.36, 0.31)
WALL_COLOR = (0.70, 0.74, 0.78)
PLAIN = 0
"""The background without patterns, as the renderer makes it."""
MOST_BACKGROUNDS = 1000
_KEPT = 100
"""Backgrounds that are kept painted, of up to 1.5 MiB each."""

Image = npt.NDArray[np.float32]
Pixels = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Background:
    """A table top and a wall.

    Attributes:
        table: (S, S, 3) uint8 RGB of the table in full light; repeats along the world's x and y.
        wall: (S, S, 3) uint8 RGB of the wall as it is seen; repeats around and up.

    What is of one colour is of size 1.
    """

    table: Pixels
    wall: Pixels


@lru_cache(maxsize=_KEPT)
def background(number: int) -> Background:
    """The background of this number; always the same.

    Raises:
        SimulationError: If there is none of this number.
    """
    if not 0 <= number <= MOST_BACKGROUNDS:
        raise SimulationError(f"background {number}: the numbers are 0 to {MOST_BACKGROUNDS}")
    if number == PLAIN:
        return Background(_even(TABLE_COLOR), _even(WALL_COLOR))
    rng = np.random.default_rng([number, *b"background"])
    # In turn, so that few backgrounds already differ in kind.
    table = _TABLES[number % len(_TABLES)](rng, _dull(rng, (0.38, 0.66)))
    wall = _WALLS[(number // 2) % len(_WALLS)](rng, _dull(rng, (0.45, 0.85)))
    return Background(_pixels(np.clip(table, *_TABLE_RANGE)), _pixels(np.clip(wall, 0.0, 1.0)))


def recomposite(frame: Frame, number: int, old: int = PLAIN) -> npt.NDArray[np.uint8]:
    """The colour image of a simulated frame before another background.

    Args:
        frame: Images, with instance ids and camera pose, of a scene on the table.
        number: The new background.
        old: The background that the frame has; from the plain one nothing is lost.

    Returns:
        (H, W, 3) uint8 RGB; pixels of objects are as they were.

    Raises:
        SimulationError: If a background does not exist, or the frame has no instance ids or no
            camera pose.
    """
    if frame.instances is None or frame.camera_pose is None:
        raise SimulationError("a background needs instance ids and the camera pose: give both")
    if number == old:
        return frame.color
    new, was = background(number), background(old)
    rays = viewing_rays(frame.intrinsics, frame.camera_pose)
    eye = np.asarray(frame.camera_pose.position, dtype=np.float32)
    color = frame.color.copy()
    wall = frame.depth == 0.0
    table = (frame.instances == 0) & ~wall
    for mask, kind in ((table, "table"), (wall, "wall")):
        rows = np.flatnonzero(mask.any(axis=1))
        if not rows.size:
            continue
        # Most of the wall is above the table: half the work.
        part = slice(rows[0], rows[-1] + 1)
        if kind == "wall":
            shown = _looked_up(new.wall, _on_wall(rays[:, part], eye), _WALL_TEXEL_M)
        else:
            shown = _relit(color[part], was.table, new.table, _on_table(rays[:, part], eye))
        cv2.copyTo(shown, mask[part].astype(np.uint8), color[part])
    return color


_SIDE = 512
_TABLE_TEXEL_M = 0.0015
_WALL_TEXEL_M = 0.006
_WALL_RADIUS_M = 3.0
_FARTHEST_M = 20.0
# Darker, the light on it could not be told from rounding; lighter, it would outshine the objects.
_TABLE_RANGE = (0.12, 0.8)

Size = tuple[float, float]
Painter = Callable[[np.random.Generator, Float], Image]


@lru_cache(maxsize=1)
def viewing_rays(camera: Intrinsics, pose: Pose) -> Image:
    """Viewing direction (3, H, W) of every pixel in the world, 1 along the optical axis.

    What is returned must not be changed: a scene asks for it several times.
    """
    right = (np.arange(camera.width, dtype=np.float32) - camera.cx) / camera.fx
    down = (np.arange(camera.height, dtype=np.float32) - camera.cy) / camera.fy
    axes = rotation_matrix(pose.orientation).astype(np.float32)
    rays = np.stack(
        [axis[0] * right[None, :] + (axis[1] * down[:, None] + axis[2]) for axis in axes]
    ).astype(np.float32, copy=False)
    rays.setflags(write=False)
    return rays


def _on_table(rays: Image, eye: Image) -> Image:
    """World x and y (2, H, W) where the rays meet the plane of the table."""
    # Of the table's rim, too: below the horizon every ray meets the plane.
    reach = np.minimum(eye[2] / np.maximum(-rays[2], 1e-6), _FARTHEST_M)
    return np.asarray(eye[:2, None, None] + reach * rays[:2])


def _on_wall(rays: Image, eye: Image) -> Image:
    """Way around and height (2, H, W), metres, on a round wall about the table."""
    x, y, z = rays
    a = np.maximum(x * x + y * y, 1e-6)
    b = eye[0] * x + eye[1] * y
    c = float(eye[0] ** 2 + eye[1] ** 2) - _WALL_RADIUS_M**2
    reach = (np.sqrt(np.maximum(b * b - a * c, 0.0)) - b) / a
    around = np.arctan2(eye[1] + reach * y, eye[0] + reach * x)
    return np.stack([_WALL_RADIUS_M * around, -(eye[2] + reach * z)])


def _relit(color: Pixels, was: Pixels, new: Pixels, places: Image) -> Pixels:
    """The new table in the light of the old one."""
    albedo = _looked_up(new, places, _TABLE_TEXEL_M)
    # What is even all over is a scalar to OpenCV.
    even: Any = (*was[0, 0].tolist(), 1.0)
    before = even if len(was) == 1 else _looked_up(was, places, _TABLE_TEXEL_M)
    change = cv2.divide(albedo, before, dtype=cv2.CV_32F)
    return np.asarray(cv2.multiply(color, change, dtype=cv2.CV_8U))


def _looked_up(image: Pixels, places: Image, texel_m: float) -> Pixels:
    """Colours (H, W, 3) of the repeating image at the places (2, H, W), metres."""
    if len(image) == 1:
        return np.broadcast_to(image[0, 0], (*places.shape[1:], 3)).copy()
    # Folded here, since OpenCV counts in 16 bits; several times faster than a remainder.
    turns = places * np.float32(1.0 / (texel_m * _SIDE))
    turns -= np.floor(turns)
    turns *= np.float32(_SIDE)
    u, v = turns
    return np.asarray(cv2.remap(image, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))


def _pixels(image: Image) -> Pixels:
    return np.asarray(np.rint(255.0 * image), dtype=np.uint8)


def _even(color: tuple[float, float, float]) -> Pixels:
    return _pixels(np.full((1, 1, 3), color, dtype=np.float32))


def _dull(rng: np.random.Generator, values: Size) -> Float:
    """A colour of little saturation."""
    return np.array(
        colorsys.hsv_to_rgb(rng.uniform(0.0, 1.0), rng.uniform(0.05, 0.3), rng.uniform(*values))
    )


def _noise(rng: np.random.Generator, finest: Size, slope: float) -> Image:
    """Noise (S, S) that repeats, of mean 0 and deviation 1.

    Args:
        rng: Source.
        finest: Size in texels of its smallest features along x and y.
        slope: How much stronger coarse features are: 0 none, 1 clouds.
    """
    u = np.fft.rfftfreq(_SIDE)[None, :]
    v = np.fft.fftfreq(_SIDE)[:, None]
    frequency = np.hypot(u * finest[0], v * finest[1])
    gain = np.exp(-(frequency**2) * 4.0) / np.maximum(frequency, 2.0 / _SIDE) ** slope
    gain[0, 0] = 0.0
    noise = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((_SIDE, _SIDE))) * gain)
    return np.asarray(noise / noise.std(), dtype=np.float32)


def _shaded(color: Float, brightness: npt.NDArray[np.floating]) -> Image:
    return np.asarray(color * brightness[..., None], dtype=np.float32)


def _cells(width: int, height: int, shift: int) -> tuple[Image, Image, Image, Image]:
    """Column, row, and place within the cell (0 to 1), each (S, S); odd rows are shifted."""
    y, x = np.mgrid[0:_SIDE, 0:_SIDE]
    row = y // height
    x = (x + shift * (row % 2)) % _SIDE
    return x // width, row, (x % width) / width, (y % height) / height


def _joints(
    rng: np.random.Generator, color: Float, cell: tuple[int, int], shift: int, joint_texels: float
) -> Image:
    """Tiles, bricks or planks: cells of varying brightness with joints between them."""
    column, row, u, v = _cells(*cell, shift)
    shades = 1.0 + 0.10 * rng.standard_normal((_SIDE // cell[0], _SIDE // cell[1])).T
    brightness = shades[row, column] + 0.04 * _noise(rng, (2.0, 2.0), 0.7)
    joint = np.minimum(
        np.minimum(u, 1.0 - u) * cell[0] / joint_texels,
        np.minimum(v, 1.0 - v) * cell[1] / joint_texels,
    )
    dark = rng.uniform(0.55, 0.75)
    return _shaded(color, brightness * (dark + (1.0 - dark) * np.clip(joint, 0.0, 1.0)))


def _tiles(rng: np.random.Generator, color: Float) -> Image:
    side = int(rng.choice([64, 128]))
    return _joints(rng, color, (side, side), 0, 2.0)


def _planks(rng: np.random.Generator, color: Float) -> Image:
    brown = 0.5 * color + 0.5 * np.mean(color) * np.array([1.25, 1.0, 0.75])
    grain = _noise(rng, (64.0, 2.0), 0.5) + 0.6 * _noise(rng, (128.0, 8.0), 0.5)
    planks = _joints(rng, brown, (256, 64), 128, 1.5)
    return np.asarray(planks * (1.0 + 0.07 * grain[..., None]), dtype=np.float32)


def _stone(rng: np.random.Generator, color: Float) -> Image:
    clouds = _noise(rng, (3.0, 3.0), 1.3)
    veins = np.exp(-((3.0 * _noise(rng, (4.0, 4.0), 1.5)) ** 2))
    return _shaded(color, 1.0 + 0.08 * clouds - rng.uniform(0.1, 0.35) * veins)


def _speckles(rng: np.random.Generator, color: Float) -> Image:
    return _shaded(color, 1.0 + 0.12 * _noise(rng, (3.0, 3.0), 0.0))


def _cloth(rng: np.random.Generator, color: Float) -> Image:
    side = int(rng.choice([32, 64]))
    y, x = np.mgrid[0:_SIDE, 0:_SIDE] // side % 2
    weave = 1.0 + 0.04 * _noise(rng, (2.0, 2.0), 0.0)
    return _shaded(color, (1.0 - rng.uniform(0.12, 0.22) * (x + y)) * weave)


def _stripes(rng: np.random.Generator, color: Float) -> Image:
    width = int(rng.choice([16, 32, 64]))
    x = np.tile(np.arange(_SIDE) // width % 2, (_SIDE, 1))
    return _shaded(color, 1.0 - rng.uniform(0.15, 0.3) * x + 0.02 * _noise(rng, (3.0, 3.0), 0.0))


def _plaster(rng: np.random.Generator, color: Float) -> Image:
    return _shaded(color, 1.0 + 0.04 * _noise(rng, (3.0, 3.0), 0.8))


def _bricks(rng: np.random.Generator, color: Float) -> Image:
    return _joints(rng, color, (64, 32), 32, 2.0)


def _room(rng: np.random.Generator, color: Float) -> Image:
    """Things out of focus: large soft blots of other dull colours."""
    blots = np.stack([_noise(rng, (40.0, 60.0), 0.6) for _ in range(3)], axis=-1)
    duller = 0.35 * blots + 0.65 * blots.mean(axis=-1, keepdims=True)
    return np.asarray(color * (1.0 + 0.2 * np.tanh(duller)), dtype=np.float32)


def _panels(rng: np.random.Generator, color: Float) -> Image:
    return _joints(rng, color, (128, 512), 0, 4.0)


_TABLES: tuple[Painter, ...] = (_planks, _tiles, _stone, _cloth, _speckles, _stripes)
_WALLS: tuple[Painter, ...] = (_plaster, _bricks, _stripes, _room, _panels)
