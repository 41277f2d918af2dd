"""Exact relations: what a careful person would say who may walk round the table and measure.

Computed from meshes and contacts, never from images, so that estimators can be judged by them.
Directions are those of a gravity-up naming frame (`naming_axes`). Per pair the first that applies:

*in*: at least half of the object's volume lies inside the convex hull of the reference.
Ambiguous from 35 to 65 %.

*above*, *below*: the two overlap seen from above (the plumb lines of at least 2 % of the volume of
one of them meet the other), and one either begins less than 5 mm below the other's top, or rests
on the other (they are at most 2 mm apart and there the surface is less than 45 degrees from
level). Clear if it rests or if 25 % of the volume of one overlap, else judged by direction too.

Otherwise the direction decides: left, right, front, behind, above or below, along the axis on
which the pair is separated most. Let g be the gap between the extents of the two along an axis
(negative where they overlap) and h the smallest, over the axes, sum of half extents; then the
direction is the vector of max(0, g + h): for things of equal size the direction from centre to
centre, for long ones the direction from the nearest part of their core. Ambiguous where the two
largest of its components are of the same size within 10 degrees (35 to 55 degrees off the axis).

*touching*: the meshes are at most 2 mm apart; *far*: 1 m or more; else *not_touching*. Ambiguous
from 2 mm (not included) to 10 mm and from 0.95 to 1.05 m: a gap that no eye or sensor is sure of.

Source of the vocabulary: the paper's section *Grounding of Spatial Relations*.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float, Length, Pose, rotation_matrix
from ros_scenesense.messages.base import Name, Part
from ros_scenesense.scene import Distance, Position
from ros_scenesense.simulation.solids import Solid

IN_SHARE = 0.5
IN_BAND = (0.35, 0.65)
OVERLAP_SHARE = 0.02
CLEAR_OVERLAP_SHARE = 0.25
ENTERED_M = 0.005
LEVEL_COSINE = math.cos(math.radians(45.0))
CLEAR_DIRECTION_RAD = math.radians(35.0)
TOUCHING_M = 0.002
NOT_SURELY_APART_M = 0.010
FAR_M = 1.0
FAR_BAND_M = (0.95, 1.05)


class ExactRelation(Part, frozen=True):
    """The true relations of one unordered pair.

    Its direction is that of `relations`: `in` names the contained object first, everything else
    is said of the first name in the order of names. `distance_m` is the least distance between
    the two.
    """

    object: Name
    reference: Name
    position: Position
    position_ambiguous: bool
    distance: Distance
    distance_ambiguous: bool
    distance_m: Length


@dataclass(frozen=True)
class Contact:
    """How near two solids come to each other.

    Attributes:
        distance_m: The least distance between the two meshes, 0 if they meet.
        up: Upward component of the unit normal, from the second to the first, where they meet:
            1 if the first stands level on the second, -1 if the second stands on the first.
    """

    distance_m: float
    up: float


def naming_axes(viewpoint: Pose | None) -> Float:
    """The gravity-up axes along which relations are named.

    Args:
        viewpoint: Pose of a camera's optical frame in the world for the viewer's frame, in which
            away is where the camera looks; None for the robot's frame, the world's own axes.

    Returns:
        (3, 3), its rows are right, away and up as unit vectors in the world.
    """
    up = np.array([0.0, 0.0, 1.0])
    if viewpoint is None:
        return np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], up])
    rotation = rotation_matrix(viewpoint.orientation)
    away = rotation[:, 2] * [1.0, 1.0, 0.0]
    if np.linalg.norm(away) < 1e-3:  # looking straight down, away is where the image's top is
        away = -rotation[:, 1] * [1.0, 1.0, 0.0]
    away /= np.linalg.norm(away)
    return np.stack([np.cross(away, up), away, up])


def exact_relations(
    names: Sequence[str],
    solids: Sequence[Solid],
    contacts: Mapping[tuple[int, int], Contact],
    axes: Float,
) -> list[ExactRelation]:
    """The relations of every unordered pair, sorted by the names of the pair.

    Args:
        names: Of the objects, all different.
        solids: The objects in the world frame.
        contacts: How near object i comes to object j by (i, j), i < j.
        axes: As `naming_axes` gives them.
    """
    turned = [_Placed.of(solid.moved(axes, np.zeros(3))) for solid in solids]
    order = sorted(range(len(names)), key=names.__getitem__)
    relations = []
    for position, i in enumerate(order):
        for j in order[position + 1 :]:
            contact = contacts[min(i, j), max(i, j)]
            up = contact.up if i < j else -contact.up
            placed = _position(turned[i], turned[j], contact.distance_m, up)
            first, second = (j, i) if placed.swapped else (i, j)
            distance, distance_ambiguous = _distance(contact.distance_m)
            relations.append(
                ExactRelation(
                    object=names[first],
                    reference=names[second],
                    position=placed.position,
                    position_ambiguous=placed.ambiguous,
                    distance=distance,
                    distance_ambiguous=distance_ambiguous,
                    distance_m=contact.distance_m,
                )
            )
    return relations


# By axis of the naming frame: said of the object on the positive side, and on the negative one.
_DIRECTIONS = (
    (Position.RIGHT, Position.LEFT),
    (Position.BEHIND, Position.FRONT),
    (Position.ABOVE, Position.BELOW),
)


@dataclass(frozen=True, eq=False)
class _Placed:
    """A solid in the naming frame, and its extents along the axes."""

    solid: Solid
    low: Float
    high: Float

    @classmethod
    def of(cls, solid: Solid) -> _Placed:
        return cls(solid, solid.vertices.min(axis=0), solid.vertices.max(axis=0))


@dataclass(frozen=True)
class _Said:
    position: Position
    ambiguous: bool
    swapped: bool = False


def _position(one: _Placed, other: _Placed, distance_m: float, up: float) -> _Said:
    offset = (one.low + one.high - other.low - other.high) / 2.0
    reach = (one.high - one.low + other.high - other.low) / 2.0
    gaps = np.abs(offset) - reach
    shares = (0.0, 0.0)
    if (gaps < 0.0).all():
        shares = one.solid.share_inside(other.solid), other.solid.share_inside(one.solid)
    if max(shares) >= IN_SHARE:
        return _Said(Position.IN, max(shares) < IN_BAND[1], swapped=shares[1] > shares[0])
    said = _overlapping(one, other, float(offset[2]), float(gaps[2]), distance_m, up)
    direction = _direction(offset, gaps + reach.min())
    if said is None:
        said = direction
    elif said.ambiguous:
        said = _Said(said.position, direction.ambiguous or direction.position is not said.position)
    return _Said(said.position, said.ambiguous or max(shares) >= IN_BAND[0])


def _overlapping(
    one: _Placed, other: _Placed, rise_m: float, gap_m: float, distance_m: float, up: float
) -> _Said | None:
    """Above or below of two that overlap seen from above; None if not, or if side by side."""
    if (np.minimum(one.high, other.high) < np.maximum(one.low, other.low))[:2].any():
        return None
    overlap = max(one.solid.share_over(other.solid), other.solid.share_over(one.solid))
    if overlap < OVERLAP_SHARE:
        return None
    rests = distance_m <= TOUCHING_M and abs(up) >= LEVEL_COSINE
    if not rests and gap_m < -ENTERED_M:
        return None
    higher = (up if rests else rise_m) > 0.0
    position = Position.ABOVE if higher else Position.BELOW
    return _Said(position, not rests and overlap < CLEAR_OVERLAP_SHARE)


def _direction(offset: Float, components: Float) -> _Said:
    """The direction along the axis of the largest component, (3,) each."""
    components = np.maximum(components, 0.0)
    axis = int(components.argmax())
    second, largest = np.sort(components)[1:]
    ambiguous = bool(math.atan2(second, largest) > CLEAR_DIRECTION_RAD) or largest == 0.0
    return _Said(_DIRECTIONS[axis][0 if offset[axis] > 0.0 else 1], ambiguous)


def _distance(distance_m: float) -> tuple[Distance, bool]:
    if distance_m <= TOUCHING_M:
        return Distance.TOUCHING, False
    ambiguous = distance_m <= NOT_SURELY_APART_M or FAR_BAND_M[0] <= distance_m < FAR_BAND_M[1]
    return (Distance.FAR if distance_m >= FAR_M else Distance.NOT_TOUCHING), ambiguous
