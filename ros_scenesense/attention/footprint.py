"""The area on which an object stands, seen from above: a circle or a rectangle, as its front tells.

Only the front of an object is seen, but what people stack is mostly round or rectangular, and then
the front tells the rest. Of a circle the two lines of sight that touch it and the nearest place
are enough. Of a rectangle two faces are seen, or one of them: the second is then taken to be as
wide as the first, unless the upper face shows how far back it reaches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.attention.regions import Rectangle
from ros_scenesense.attention.scan import Scan, percentile, scan_of
from ros_scenesense.geometry import Box, Float, Intrinsics

_STRAY_M = 0.008
"""What is farther from a circle counts as if it were so far."""
_ROUND = 1.3
"""A rectangle has more freedom than a circle: it must fit better by this factor."""
_CIRCLE_CORNERS = 16
_COARSE_DEG, _FINE_DEG = 5.0, 1.0
_FEWEST_OF_FACE = 3
"""Directions that a face needs to be one that is seen."""
_GRAZING = 0.25
"""Sine of the angle between a line of sight and a face below which the face is hardly seen."""
_SQUARE = 1.3
"""Sides that differ by a smaller factor are taken to be equal."""
_LEAST_SIDE_M = 0.003
_FEWEST_OF_TOP = 12


@dataclass(frozen=True, eq=False)
class Footprint:
    """An object from above.

    Attributes:
        corners: (K, 2) of its convex outline in turn: metres to the right and away from the viewer.
        height: Metres.
    """

    corners: Float
    height: float

    @property
    def middle(self) -> Float:
        """Its centre (2,); of a circle or a rectangle the mean of the corners."""
        return np.asarray(self.corners.mean(axis=0))

    @property
    def area(self) -> float:
        """Square metres."""
        return abs(_turn(self.corners)) / 2.0

    def beyond(self, place: Float) -> float:
        """How far outside a place (2,) is, metres; negative inside."""
        edges = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1) * np.sign(_turn(self.corners))
        lengths = np.linalg.norm(normals, axis=1)
        from_edges = ((place - self.corners) * normals).sum(axis=1) / np.maximum(lengths, 1e-9)
        return float(from_edges.max())


def _turn(corners: Float) -> float:
    """Twice the area, positive if the corners go anticlockwise."""
    after = np.roll(corners, -1, axis=0)
    return float((corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]).sum())


def footprint_of(
    depth: npt.NDArray[np.float32],
    intrinsics: Intrinsics,
    mask: npt.NDArray[np.bool_],
    place: Rectangle,
    axes: Float,
    covered: bool,
) -> Footprint | None:
    """The footprint of one object.

    Args:
        depth: (h, w) metres in a part of the image; 0 or NaN where nothing was read.
        intrinsics: Of the whole image.
        mask: (h, w) the pixels of the object.
        place: Which part.
        axes: As `scan.viewer_axes` gives them.
        covered: Whether something stands on it, so that its upper face does not show how far back
            it reaches.

    Returns:
        None if too little of it was read.
    """
    scan = scan_of(depth, intrinsics, mask, place, axes)
    if scan is None:
        return None
    corners, misfit = _circle(scan)
    rectangle = _rectangle(scan, covered)
    if rectangle is not None and rectangle[1] * _ROUND < misfit:
        corners = rectangle[0]
    cosine, sine = np.cos(scan.bearing), np.sin(scan.bearing)
    return Footprint(corners @ np.array([[cosine, -sine], [sine, cosine]]), scan.height)


def box_footprint(box: Box, axes: Float) -> Footprint:
    """That of a box of what is hardly seen: only its front is, so it is as deep as it is wide."""
    places = box.corners() @ axes.T
    low, high = places.min(axis=0), places.max(axis=0)
    far = max(high[1], low[1] + high[0] - low[0])
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], far], [low[0], far]])
    return Footprint(corners, float(high[2] - low[2]))


def _circle(scan: Scan) -> tuple[Float, float]:
    """Corners of the circle between the outermost lines of sight, and the mean square misfit."""
    sine = np.sin(scan.half_angle)
    # Of a circle whose centre is one metre away; its rim is seen too flat to count.
    depth = np.sqrt(np.maximum(sine**2 - np.sin(scan.angles) ** 2, 0.0))
    unit = np.cos(scan.angles) - depth
    weights = np.where(np.abs(scan.angles) < 0.9 * scan.half_angle, scan.weights, 0.0)
    ranges = np.linalg.norm(scan.near, axis=1)
    distance = (weights * ranges * unit).sum() / max((weights * unit * unit).sum(), 1e-9)
    radius, centre = distance * sine, np.array([0.0, distance])
    off = np.abs(np.linalg.norm(scan.near - centre, axis=1) - radius)
    misfit = np.average(np.minimum(off, _STRAY_M) ** 2, weights=scan.weights)
    angles = np.arange(_CIRCLE_CORNERS) * (2.0 * np.pi / _CIRCLE_CORNERS)
    corners = centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return corners, float(misfit)


@dataclass(frozen=True)
class _Faces:
    """Two faces at a right angle, fitted to the front.

    Attributes:
        angle: By which the left one's normal is turned to the left, radians from 0 to pi/2.
        left: Distance (signed) of the left face along its normal; NaN where it is not seen.
        right: Of the right face.
        count: How many of the directions see the left face.
        misfit: Mean square distance from the faces.
    """

    angle: float
    left: float
    right: float
    count: int
    misfit: float


def _faces(scan: Scan, angles: Float) -> _Faces:
    """The best of all ways to turn the faces and to share out the directions among them."""
    normals = np.stack([-np.sin(angles), -np.cos(angles)], axis=1)
    weights = np.concatenate([[0.0], np.cumsum(scan.weights)])
    before, after = np.maximum(weights, 1e-9), np.maximum(weights[-1] - weights, 1e-9)
    sums = []
    for face in (normals, normals @ np.array([[0.0, 1.0], [-1.0, 0.0]])):
        along = face @ scan.near.T  # (angles, directions)
        for power in (along, along**2):
            sums.append(np.zeros((len(angles), len(scan.near) + 1)))
            np.cumsum(scan.weights * power, axis=1, out=sums[-1][:, 1:])
    left, left_square, right, right_square = sums
    right, right_square = right[:, -1:] - right, right_square[:, -1:] - right_square
    spread = left_square - left**2 / before + right_square - right**2 / after
    best, count = np.unravel_index(np.argmin(spread), spread.shape)
    return _Faces(
        angle=float(angles[best]),
        left=float(left[best, count] / before[count]) if count > 0 else np.nan,
        right=float(right[best, count] / after[count]) if count < len(scan.near) else np.nan,
        count=int(count),
        misfit=float(spread[best, count] / weights[-1]),
    )


def _rectangle(scan: Scan, covered: bool) -> tuple[Float, float] | None:
    """Corners of the rectangle with the faces that are seen, and the mean square misfit."""
    coarse = _faces(scan, np.deg2rad(np.arange(0.0, 90.0, _COARSE_DEG)))
    around = np.deg2rad(np.arange(1.0 - _COARSE_DEG, _COARSE_DEG, _FINE_DEG))
    faces = _faces(scan, coarse.angle + around)
    sine, cosine = np.sin(faces.angle), np.cos(faces.angle)
    left_normal, right_normal = np.array([-sine, -cosine]), np.array([cosine, -sine])
    sights = np.array([[-1.0, 1.0], [1.0, 1.0]]) * (
        np.sin(scan.half_angle),
        np.cos(scan.half_angle),
    )
    others = len(scan.near) - faces.count
    left_seen = faces.count >= _FEWEST_OF_FACE and -(left_normal @ sights[0]) > _GRAZING
    right_seen = others >= _FEWEST_OF_FACE and -(right_normal @ sights[1]) > _GRAZING
    left, right = faces.left, faces.right
    if left_seen and right_seen:
        # Each face ends where the outermost line of sight meets it.
        length = right - right_normal @ sights[0] * left / (left_normal @ sights[0])
        width = left - left_normal @ sights[1] * right / (right_normal @ sights[1])
        if 0.0 < max(length, width) < _SQUARE * min(length, width):
            shares = np.array([faces.count, others]) ** 2
            length = width = float(np.average([length, width], weights=shares))
    elif left_seen or right_seen:
        top = np.zeros((0, 2)) if covered else scan.top
        if right_seen:
            left, length, width = _one_face(left_normal, right_normal, right, sights, top)
        else:
            right, width, length = _one_face(right_normal, left_normal, left, sights[::-1], top)
    else:
        return None
    if not min(length, width) > _LEAST_SIDE_M:
        return None
    across = np.array([left, left, left - width, left - width])
    along = np.array([right, right - length, right - length, right])
    corners = across[:, None] * left_normal + along[:, None] * right_normal
    return corners, faces.misfit


def _one_face(
    hidden: Float, normal: Float, distance: float, sights: Float, top: Float
) -> tuple[float, float, float]:
    """The rectangle of which one face is seen well and the other hardly or not at all.

    Args:
        hidden: Normal (2,) of the other face.
        normal: Normal (2,) of the face that is seen.
        distance: Of this face along its normal.
        sights: (2, 2) directions that touch the object, first where the other face is.
        top: (M, 2) places of the upper face.

    Returns:
        Distance of the other face, depth behind the face that is seen, and its width.
    """
    corner = sights[0] * distance / (normal @ sights[0])
    end = hidden @ sights[1] * distance / (normal @ sights[1])
    turned = bool(hidden @ sights[0] < 0.0)  # the line of sight touches the far end of the other
    if len(top) >= _FEWEST_OF_TOP:
        depth = distance - percentile(top @ normal, 0.04)
        touched = sights[0] * (distance - depth) / (normal @ sights[0]) if turned else corner
        other = float(hidden @ touched)
        width = float(other - end)
        if not 0.0 < max(depth, width) < _SQUARE * min(depth, width):
            return other, depth, width
    if turned:
        reach = (distance + end) / ((hidden + normal) @ sights[0])
        if reach > np.linalg.norm(corner):
            other = float(reach * (hidden @ sights[0]))
            return other, float(other - end), float(other - end)
    other = float(hidden @ corner)
    return other, float(other - end), float(other - end)
