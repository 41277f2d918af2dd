"""Noise of depth cameras, put on a perfect depth image: what a structured-light sensor would read.

The published models that it follows: axial and lateral noise of Nguyen, Izadi and Lovell, *Modeling
Kinect Sensor Noise for Improved 3D Reconstruction and Tracking* (3DIMPVT 2012); steps of disparity
of Khoshelham and Oude Elberink, *Accuracy and Resolution of Kinect Depth Data for Indoor Mapping
Applications* (Sensors 2012). Where the projector's light does not come is geometry.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

import cv2
import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Intrinsics
from ros_scenesense.scene import Frame

Depth = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

NONE = "none"
KINECT = "kinect"


@dataclass(frozen=True)
class NoiseSettings:
    """How a depth camera errs; with the defaults it does not.

    Attributes:
        axial_m: Standard deviation of a reading at `axial_from_m`, metres.
        axial_growth: How it grows: `axial_m + axial_growth * (z - axial_from_m)**2`, 1 per metre.
        axial_from_m: Distance from which it grows.
        axial_grazing: Further deviation where a surface is seen at an angle: it grows with
            `axial_grazing / sqrt(z) * angle**2 / (pi/2 - angle)**2`, the angle in radians.
        lateral: Standard deviation, as a tangent (pixels by focal length), of where a pixel looks.
        lateral_grazing: How that grows with `angle / (pi/2 - angle)`.
        baseline_m: From the camera to the projector on its right; 0 = no steps, no shadows.
        disparity_steps: Steps of the disparity per radian (steps per pixel times focal length).
        mixed_share: Share of the pixels at depth edges that read something between both sides.
        edge_dropout: Share of the pixels at depth edges that read nothing.
        dropout: Share of all pixels about which a speck of about 3 pixels reads nothing.
        grazing_from_rad: Surfaces seen at a larger angle to their normal begin to read nothing.
        grazing_to_rad: From this angle on they always read nothing; 0 = they are always read.
        nearest_m: What is nearer reads nothing.
        farthest_m: What is farther reads nothing; 0 = without limit.
    """

    axial_m: float = 0.0
    axial_growth: float = 0.0
    axial_from_m: float = 0.4
    axial_grazing: float = 0.0
    lateral: float = 0.0
    lateral_grazing: float = 0.0
    baseline_m: float = 0.0
    disparity_steps: float = 0.0
    mixed_share: float = 0.0
    edge_dropout: float = 0.0
    dropout: float = 0.0
    grazing_from_rad: float = 0.0
    grazing_to_rad: float = 0.0
    nearest_m: float = 0.0
    farthest_m: float = 0.0


_KINECT_FOCAL = 585.0
"""Focal length of the first Kinect's 640x480 images, pixels."""

PRESETS = MappingProxyType(
    {
        NONE: NoiseSettings(),
        KINECT: NoiseSettings(
            axial_m=0.0012,
            axial_growth=0.0019,
            axial_grazing=0.0001,
            lateral=0.8 / _KINECT_FOCAL,
            lateral_grazing=0.035 / _KINECT_FOCAL,
            baseline_m=0.075,
            disparity_steps=8.0 * _KINECT_FOCAL,
            mixed_share=0.3,
            edge_dropout=0.3,
            dropout=0.0004,
            grazing_from_rad=np.deg2rad(70.0),
            grazing_to_rad=np.deg2rad(88.0),
            nearest_m=0.3,
            farthest_m=5.0,
        ),
    }
)
"""Settings by name: `none`, and `kinect`, the first Kinect."""


def noisy(
    depth: Depth, intrinsics: Intrinsics, settings: NoiseSettings, rng: np.random.Generator
) -> Depth:
    """What the camera would read instead of the truth.

    Args:
        depth: (H, W) metres along the optical axis; 0 or NaN where there is nothing.
        intrinsics: Of the image. Its resolution may be any: lateral noise, shadows and steps keep
            their size in the world.
        settings: How the camera errs.
        rng: Source of all randomness.

    Returns:
        (H, W) metres, 0 where nothing is read.

    Raises:
        SimulationError: If the image is not of the camera's size.
    """
    expected = (intrinsics.height, intrinsics.width)
    if depth.shape != expected:
        raise SimulationError(
            f"the depth image is {depth.shape}, its camera's images are {expected}: noise needs "
            "the intrinsics of the image"
        )
    z = np.where(np.isfinite(depth) & (depth > 0.0), depth, np.float32(0.0)).astype(np.float32)
    if settings == PRESETS[NONE]:
        return z
    angle = _angles(z, intrinsics)
    edge = _edges(z)
    lost = _shadowed(z, intrinsics, settings) | (z <= 0.0)
    lost |= _dropped(z.shape, angle, edge, settings, rng)
    read = _shifted(z, angle, intrinsics, settings, rng)
    read = _mixed(read, edge, settings, rng)
    steep = np.square(angle / (np.pi / 2.0 - angle))
    with np.errstate(divide="ignore", invalid="ignore"):
        deviation = (
            settings.axial_m
            + settings.axial_growth * np.square(read - settings.axial_from_m)
            + settings.axial_grazing / np.sqrt(read) * steep
        )
        read = read + deviation * rng.standard_normal(z.shape, dtype=np.float32)
        steps = settings.disparity_steps * settings.baseline_m
        if steps > 0.0:
            read = steps / np.round(steps / read)
    lost |= ~(np.isfinite(read) & (read > max(settings.nearest_m, 0.0)))
    if settings.farthest_m > 0.0:
        lost |= read > settings.farthest_m
    return np.where(lost, 0.0, read).astype(np.float32)


def noisy_frame(frame: Frame, settings: NoiseSettings, rng: np.random.Generator) -> Frame:
    """The frame with the depth that the camera would read; colour and instances stay."""
    return replace(frame, depth=noisy(frame.depth, frame.intrinsics, settings, rng))


# Neighbours whose depths differ by more than this share of their distance are of two surfaces.
_EDGE_SHARE = 0.02
# The angle formulas have their pole at a right angle.
_STEEPEST_RAD = np.deg2rad(88.0)


def _angles(z: Depth, intrinsics: Intrinsics) -> Depth:
    """Angle (H, W) between each pixel's line of sight and the surface's normal, radians."""
    u = ((np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx).astype(np.float32)
    v = ((np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy).astype(np.float32)[:, None]
    # Per tangent of the viewing direction; one-sided, whichever side changes less, so that the
    # step to another surface does not count as a slope.
    along_u = _gentlest(z, axis=1) * np.float32(intrinsics.fx)
    along_v = _gentlest(z, axis=0) * np.float32(intrinsics.fy)
    with np.errstate(divide="ignore", invalid="ignore"):
        # The normal of the surface (u z, v z, z) is this vector, up to its length.
        normal_x, normal_y = -along_u, -along_v
        normal_z = z + along_u * u + along_v * v
        ray = np.sqrt(u * u + v * v + 1.0)
        length = np.sqrt(np.square(normal_x) + np.square(normal_y) + np.square(normal_z))
        cosine = np.abs(z) / (ray * length)
    cosine = np.where(np.isfinite(cosine), cosine, 1.0)
    angle = np.arccos(np.clip(cosine, 0.0, 1.0))
    return np.asarray(np.minimum(angle, _STEEPEST_RAD), dtype=np.float32)


def _gentlest(z: Depth, axis: int) -> Depth:
    """Difference to the next pixel along an axis, to that side on which it is smaller."""
    step = np.diff(z, axis=axis)
    pad = [(0, 0), (0, 0)]
    pad[axis] = (0, 1)
    after = np.pad(step, pad, mode="edge")
    pad[axis] = (1, 0)
    before = np.pad(step, pad, mode="edge")
    return np.where(np.abs(after) < np.abs(before), after, before)


def _edges(z: Depth) -> Mask:
    """Pixels (H, W) next to which another surface begins."""
    high, low = cv2.dilate(z, _NEIGHBOURS), cv2.erode(z, _NEIGHBOURS)
    return np.asarray(high - low > _EDGE_SHARE * high)


_NEIGHBOURS = np.ones((3, 3), dtype=np.uint8)


def _shadowed(z: Depth, intrinsics: Intrinsics, settings: NoiseSettings) -> Mask:
    """Pixels (H, W) that the projector's light does not reach: something nearer is before them."""
    if settings.baseline_m <= 0.0:
        return np.zeros(z.shape, dtype=np.bool_)
    with np.errstate(divide="ignore"):
        disparity = np.where(z > 0.0, intrinsics.fx * settings.baseline_m / z, 0.0)
    # Columns as the projector has them. Rays cross where the order of columns is reversed.
    projected = np.arange(intrinsics.width) - disparity
    least = np.minimum.accumulate(projected[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(projected > least + 0.5)


def _dropped(
    shape: tuple[int, ...],
    angle: Depth,
    edge: Mask,
    settings: NoiseSettings,
    rng: np.random.Generator,
) -> Mask:
    """Pixels (H, W) that read nothing: specks, at edges, and surfaces seen at a grazing angle."""
    specks = (rng.random(shape) < settings.dropout).astype(np.uint8)
    lost = cv2.dilate(specks, _NEIGHBOURS).astype(np.bool_)
    lost |= edge & (rng.random(shape) < settings.edge_dropout)
    span = settings.grazing_to_rad - settings.grazing_from_rad
    if span > 0.0:
        lost |= rng.random(shape) < (angle - settings.grazing_from_rad) / span
    return np.asarray(lost)


def _shifted(
    z: Depth,
    angle: Depth,
    intrinsics: Intrinsics,
    settings: NoiseSettings,
    rng: np.random.Generator,
) -> Depth:
    """What pixels (H, W) read that look a little beside their direction."""
    if settings.lateral <= 0.0:
        return z
    deviation = settings.lateral + settings.lateral_grazing * angle / (np.pi / 2.0 - angle)
    rows, columns = np.indices(z.shape, dtype=np.float32)
    beside_u = deviation * intrinsics.fx * rng.standard_normal(z.shape, dtype=np.float32)
    beside_v = deviation * intrinsics.fy * rng.standard_normal(z.shape, dtype=np.float32)
    shifted = cv2.remap(
        z,
        np.rint(columns + beside_u).astype(np.float32),
        np.rint(rows + beside_v).astype(np.float32),
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(shifted, dtype=np.float32)


def _mixed(z: Depth, edge: Mask, settings: NoiseSettings, rng: np.random.Generator) -> Depth:
    """The readings (H, W) with some at edges between the nearer and the farther surface."""
    chosen = edge & (rng.random(z.shape) < settings.mixed_share)
    far = cv2.dilate(z, _NEIGHBOURS)
    # Where there is nothing is no surface to mix with.
    near = cv2.erode(np.where(z > 0.0, z, far), _NEIGHBOURS)
    between = near + (far - near) * rng.random(z.shape, dtype=np.float32)
    return np.where(chosen, between, z).astype(np.float32)
