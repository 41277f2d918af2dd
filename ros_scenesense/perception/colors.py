"""The name that people give to an object's colour."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

# Hues in CIELAB, degrees: each name reaches from its number to the next one.
_HUES = (
    (-15.0, "red"),
    (52.0, "orange"),
    (75.0, "yellow"),
    (108.0, "green"),
    (185.0, "turquoise"),
    (235.0, "blue"),
    (312.0, "purple"),
    (345.0, "red"),
)
_PINK, _BROWN, _WHITE, _GREY, _BLACK = "pink", "brown", "white", "grey", "black"

# Less chroma is no hue.
_LEAST_CHROMA = 13.0
# Of the lightness that a fifth of the pixels pass: shadow and print make the others darker.
_LIGHT_PERCENT = 80.0
_WHITE_FROM, _BLACK_TO = 57.0, 25.0
# Dull and dark oranges are brown, light reds pink.
_BROWN_TO_LIGHTNESS, _BROWN_TO_CHROMA = 46.0, 36.0
_PINK_FROM_LIGHTNESS = 68.0
# So many of the pixels must agree, or the object has no one colour.
_LEAST_SHARE = 0.55
_FEWEST_PIXELS = 20


def name_color(pixels: npt.NDArray[np.uint8]) -> str | None:
    """The colour of most of the pixels (N, 3) RGB; None if there is no such colour."""
    if len(pixels) < _FEWEST_PIXELS:
        return None
    scaled = (pixels.astype(np.float32) / np.float32(255.0))[:, None]
    lightness, a, b = cv2.cvtColor(scaled, cv2.COLOR_RGB2LAB)[:, 0].T
    chroma = np.hypot(a, b)
    colored = chroma >= _LEAST_CHROMA
    if np.mean(~colored) >= _LEAST_SHARE:
        light = float(np.percentile(lightness[~colored], _LIGHT_PERCENT))
        if light >= _WHITE_FROM:
            return _WHITE
        return _BLACK if light <= _BLACK_TO else _GREY
    hue = (np.degrees(np.arctan2(b, a)) - _HUES[0][0]) % 360.0 + _HUES[0][0]
    number = np.searchsorted([start for start, _ in _HUES], hue, side="right") - 1
    # The first and the last range are of one name.
    number[number == len(_HUES) - 1] = 0
    counts = np.bincount(number[colored], minlength=len(_HUES))
    best = int(counts.argmax())
    if counts[best] < _LEAST_SHARE * len(pixels):
        return None
    mine = colored & (number == best)
    light = float(np.percentile(lightness[mine], _LIGHT_PERCENT))
    strong = float(np.median(chroma[mine]))
    name = _HUES[best][1]
    if name in ("red", "orange") and light < _BROWN_TO_LIGHTNESS and strong < _BROWN_TO_CHROMA:
        return _BROWN
    return _PINK if name == "red" and light > _PINK_FROM_LIGHTNESS else name
