"""Point clouds of the objects of a frame, and the cloud of the whole frame for people to see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float
from ros_scenesense.scene import Frame

# A voxel grid has no room for readings that are not of this world.
_FARTHEST_M = 1000.0


@dataclass(frozen=True, eq=False)
class ObjectCloud:
    """What depth says of one object.

    Attributes:
        readings: How many of its pixels have a depth reading of its surface.
        points: A random sample of these, (M, 3) metres in the camera optical frame.
        pixels: (M,) their flat indices in the image.
    """

    readings: int
    points: Float
    pixels: npt.NDArray[np.intp]


def object_clouds(
    points: npt.NDArray[np.floating],
    instances: npt.NDArray[np.uint16],
    ids: Sequence[int],
    sample: int,
    rng: np.random.Generator,
) -> list[ObjectCloud]:
    """Splits the points of an image by object.

    Args:
        points: (H, W, 3) metres; z is not finite where there is no reading.
        instances: (H, W) instance ids, 0 = background.
        ids: The objects wanted, each from 1 to 65535.
        sample: At most this many points are kept of an object: relations need the shape of a
            cloud, not its density, and cost grows with the number of points.
        rng: Draws the samples.

    Returns:
        One cloud per id, in the same order; empty for an object without any reading. Readings
        beside a nearer surface are left out: there, cameras mix the two, and read what is behind.
    """
    flat = points.reshape(-1, 3)
    labels = instances.reshape(-1)
    pixels = np.flatnonzero((instances > 0) & _of_surfaces(points[..., 2], instances))
    # Sorted by object, the pixels of each are one slice: no pass over the image per object.
    pixels = pixels[np.argsort(labels[pixels], kind="stable")]
    sorted_labels = labels[pixels]
    first = np.searchsorted(sorted_labels, ids, side="left")
    last = np.searchsorted(sorted_labels, ids, side="right")
    drawn = [_draw(pixels[start:end], sample, rng) for start, end in zip(first, last, strict=True)]
    return [
        ObjectCloud(int(end - start), flat[mine].astype(np.float64), mine)
        for start, end, mine in zip(first, last, drawn, strict=True)
    ]


def background_points(
    points: npt.NDArray[np.floating],
    instances: npt.NDArray[np.uint16],
    sample: int,
    rng: np.random.Generator,
) -> Float:
    """At most `sample` random points (N, 3) of the pixels that belong to no object.

    Args:
        points: (H, W, 3) metres; z is not finite where there is no reading.
        instances: (H, W) instance ids, 0 = background.
        sample: How many points are wanted.
        rng: Draws them.
    """
    flat = points.reshape(-1, 3)
    pixels = np.flatnonzero((instances.reshape(-1) == 0) & np.isfinite(flat[:, 2]))
    return flat[_draw(pixels, sample, rng)].astype(np.float64)


def frame_cloud(
    frame: Frame, voxel_m: float
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint8]]:
    """The coloured cloud of a frame, thinned to one mean point per voxel.

    Args:
        frame: The images.
        voxel_m: Edge of a voxel in metres; 0 keeps every pixel that has a reading (up to 1 km).

    Returns:
        Points (N, 3) float32 metres in the optical frame, and their colours (N, 3) uint8 RGB.
    """
    import open3d  # takes seconds: only where a cloud is wanted

    camera = frame.intrinsics
    intrinsic = open3d.camera.PinholeCameraIntrinsic(
        camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy
    )
    # Open3D takes anything with a buffer, which its types say of no numpy array.
    color: Any = np.ascontiguousarray(frame.color)
    readings = np.isfinite(frame.depth) & (frame.depth > 0.0)
    depth: Any = np.where(readings, frame.depth, np.float32(0.0))
    image = open3d.geometry.RGBDImage.create_from_color_and_depth(
        open3d.geometry.Image(color),
        open3d.geometry.Image(depth),
        depth_scale=1.0,
        depth_trunc=_FARTHEST_M,
        convert_rgb_to_intensity=False,
    )
    cloud = open3d.geometry.PointCloud.create_from_rgbd_image(image, intrinsic)
    if voxel_m > 0.0 and len(cloud.points) > 0:
        cloud = cloud.voxel_down_sample(voxel_m)
    points = np.asarray(cloud.points, dtype=np.float32).reshape(-1, 3)
    colors = np.rint(np.asarray(cloud.colors).reshape(-1, 3) * 255.0).astype(np.uint8)
    return points, colors


def _of_surfaces(
    depth: npt.NDArray[np.floating], instances: npt.NDArray[np.uint16]
) -> npt.NDArray[np.bool_]:
    """Pixels (H, W) with a reading, and not close to one that is clearly nearer.

    Of an object that would lose most of its readings all are kept: it is slender, or seen at a
    grazing angle.
    """
    readings = np.isfinite(depth)
    z = np.where(readings, depth, np.inf).astype(np.float32)
    reach = round(_MIXED_PER_COLUMN * depth.shape[1])
    nearest = cv2.erode(z, np.ones((2 * reach + 1, 2 * reach + 1), dtype=np.uint8))
    with np.errstate(invalid="ignore"):  # inf - inf where nothing is read
        clear = readings & (z - nearest <= _MIXED_M + _MIXED_SHARE * nearest)
    before, after = (np.bincount(instances[mask]) for mask in (readings, clear))
    after = np.pad(after, (0, len(before) - len(after)))
    return np.asarray(clear | (readings & (2 * after < before)[instances * readings]))


# A mixed pixel is at most 2 of 640 columns away from the nearer surface. So near to each other,
# points of one surface differ by no more than so many metres and such a share of their distance.
_MIXED_PER_COLUMN = 2 / 640
_MIXED_M = 0.01
_MIXED_SHARE = 0.02


def _draw(
    pixels: npt.NDArray[np.intp], sample: int, rng: np.random.Generator
) -> npt.NDArray[np.intp]:
    """At most `sample` of the pixels, in random order if there are more."""
    if len(pixels) <= sample:
        return pixels
    return rng.choice(pixels, sample, replace=False)
