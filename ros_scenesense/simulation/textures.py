"""Procedural textures of objects: patterns in space, through which the object's surface cuts.

A pattern is a function of the place in the object's own frame, evaluated for the pixels that show
the object. So it needs no texture coordinates and no image files, fits every mesh and moves with
its object. It only darkens the colour that the object has: names of colours stay true.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Vector


class Pattern(StrEnum):
    """Patterns of textures."""

    PLAIN = "plain"
    STRIPES = "stripes"
    CHECKER = "checker"
    DOTS = "dots"
    CLOUDS = "clouds"
    VEINS = "veins"


@dataclass(frozen=True)
class Texture:
    """A pattern with its measures.

    Attributes:
        pattern: Which pattern.
        period_m: Width of its repetition.
        depth: Share of the brightness that its dark parts lack.
        direction: Unit vector in the object's frame, across the stripes.
        phases: Where in its repetition the pattern begins, radians along x, y and z.
    """

    pattern: Pattern
    period_m: float
    depth: float
    direction: Vector
    phases: Vector

    def brightness(self, points: npt.NDArray[np.floating]) -> npt.NDArray[np.float32]:
        """The share (N,) of its brightness that the object keeps at points (N, 3) of its frame."""
        if self.pattern is Pattern.PLAIN:
            return np.ones(len(points), dtype=np.float32)
        darkness = self._darkness(np.asarray(points, dtype=np.float32))
        return np.asarray(1.0 - self.depth * darkness, dtype=np.float32)

    def _darkness(self, points: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """From 0 to 1, (N,)."""
        turn = 2.0 * math.pi / self.period_m
        if self.pattern is Pattern.STRIPES:
            along = points @ np.asarray(self.direction, dtype=np.float32)
            return _edged(np.sin(turn * along + self.phases[0]))
        if self.pattern in (Pattern.CHECKER, Pattern.DOTS):
            waves = np.sin(turn * points + np.asarray(self.phases, dtype=np.float32))
            if self.pattern is Pattern.CHECKER:
                return _edged(waves.prod(axis=1) * 2.0)
            return _edged(waves.sum(axis=1) - 1.2)
        clouds = self._clouds(points * turn / 2.0)
        if self.pattern is Pattern.CLOUDS:
            return np.asarray(0.5 + 0.5 * clouds, dtype=np.float32)
        return np.asarray(np.exp(-((2.5 * clouds) ** 2)), dtype=np.float32)

    def _clouds(self, places: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Waves in many directions of space, about -1 to 1, (N,)."""
        tilt = math.atan2(self.direction[1], self.direction[0])
        steps = np.arange(_WAVES)
        # A Fibonacci spiral of directions, turned, at growing frequency.
        heights = 1.0 - 2.0 * (steps + 0.5) / _WAVES
        angles = steps * _GOLDEN_ANGLE + tilt
        flat = np.sqrt(1.0 - heights**2)
        waves = np.stack([flat * np.cos(angles), flat * np.sin(angles), heights], axis=1)
        waves *= (1.0 + 0.35 * ((5 * steps) % _WAVES))[:, None]
        shifts = np.asarray(self.phases)[steps % 3] + 1.7 * steps
        sines = np.sin(places @ waves.T.astype(np.float32) + shifts.astype(np.float32))
        return np.asarray(np.clip(sines.sum(axis=1) / (0.35 * _WAVES), -1.0, 1.0))


def draw_texture(rng: np.random.Generator) -> Texture:
    """Draws a texture."""
    pattern = list(Pattern)[int(rng.integers(len(Pattern)))]
    azimuth, height = rng.uniform(-math.pi, math.pi), rng.uniform(-1.0, 1.0)
    flat = math.sqrt(1.0 - height * height)
    phases = rng.uniform(0.0, 2.0 * math.pi, 3)
    return Texture(
        pattern=pattern,
        period_m=float(rng.uniform(*_PERIOD_M)),
        depth=float(rng.uniform(*_DEPTH)),
        direction=(flat * math.cos(azimuth), flat * math.sin(azimuth), height),
        phases=(float(phases[0]), float(phases[1]), float(phases[2])),
    )


# Finer than a pixel shows, or coarser than the smallest object, there would be nothing to see.
_PERIOD_M = (0.016, 0.04)
_DEPTH = (0.25, 0.5)
_WAVES = 8
_GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
_SHARPNESS = 3.0


def _edged(waves: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Light and dark with soft edges, so that edges that lie in a surface do not flicker."""
    return np.asarray(0.5 + 0.5 * np.tanh(_SHARPNESS * waves), dtype=np.float32)
