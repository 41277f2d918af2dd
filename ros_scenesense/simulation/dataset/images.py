"""The images of a scene as PNG files, and back.

Depth is kept in units of 0.1 mm: 16 bits reach 6.55 m, farther than a table is, and rounding moves
a point by at most 0.05 mm. Farther points become 0, which means that nothing was read, as with a
real sensor out of its range.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import DatasetError
from ros_scenesense.scene import Frame

DEPTH_UNIT_M = 0.0001
KINDS = ("color", "depth", "instances")
"""The images of every scene; a folder of the dataset has the same name."""


@dataclass(frozen=True, eq=False)
class Images:
    """The images of a scene.

    Attributes:
        color: (H, W, 3) uint8 RGB.
        depth: (H, W) float32 metres along the optical axis; 0 where nothing was read.
        instances: (H, W) uint16 instance ids; 0 is the background.
    """

    color: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    instances: npt.NDArray[np.uint16]


def encode(frame: Frame) -> dict[str, bytes]:
    """The PNG files of a frame with instance ids, by kind; the same bytes for the same frame."""
    units = np.rint(frame.depth * np.float32(1.0 / DEPTH_UNIT_M))
    units[~(units <= np.iinfo(np.uint16).max)] = 0.0
    assert frame.instances is not None
    return {
        "color": _png("color", np.ascontiguousarray(frame.color[..., ::-1])),
        "depth": _png("depth", units.astype(np.uint16)),
        "instances": _png("instances", frame.instances),
    }


def decode(files: dict[str, bytes]) -> Images:
    """The images that PNG files hold.

    Raises:
        DatasetError: If a file is no PNG image of its kind; the text names the kind.
    """
    color = _pixels("color", files["color"], np.dtype(np.uint8), 3)
    depth = _pixels("depth", files["depth"], np.dtype(np.uint16), 2)
    instances = _pixels("instances", files["instances"], np.dtype(np.uint16), 2)
    return Images(
        color=np.ascontiguousarray(color[..., ::-1]).astype(np.uint8, copy=False),
        depth=(depth.astype(np.float64) * DEPTH_UNIT_M).astype(np.float32),
        instances=instances.astype(np.uint16, copy=False),
    )


# Small files cost more time than they save disk: the first level is five times faster than the
# ninth and a tenth larger.
_ENCODING = (cv2.IMWRITE_PNG_COMPRESSION, 1, cv2.IMWRITE_PNG_STRATEGY, 0)
# One filter for all lines halves the time; for each kind the one that makes the smallest files.
# (Releases of OpenCV before 4.12 choose anew for every line.)
_FILTERS = {
    kind: (cv2.IMWRITE_PNG_FILTER, getattr(cv2, f"IMWRITE_PNG_FILTER_{name}"))
    for kind, name in (("color", "NONE"), ("depth", "UP"), ("instances", "NONE"))
    if hasattr(cv2, "IMWRITE_PNG_FILTER")
}


def _png(kind: str, pixels: npt.NDArray[np.integer | np.floating]) -> bytes:
    written, content = cv2.imencode(".png", pixels, (*_ENCODING, *_FILTERS.get(kind, ())))
    if not written:
        raise DatasetError(f"OpenCV cannot write an image of {pixels.dtype} {pixels.shape} as PNG")
    return content.tobytes()


def _pixels(
    kind: str, content: bytes, dtype: np.dtype[np.generic], dimensions: int
) -> npt.NDArray[np.generic]:
    if content:
        pixels = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
        if pixels is not None and pixels.dtype == dtype and pixels.ndim == dimensions:
            return pixels
    raise DatasetError(f"{kind} image is damaged: not a PNG of {dtype} with {dimensions} axes")
