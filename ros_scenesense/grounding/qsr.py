"""The qualitative spatial representation: a fixed meaning of the prepositions, by one of two rules.

Paper, section *Qualitative Spatial Representation*. The rule `pyramids` is the paper's, see
`pyramids`; `improved` measures gaps between boxes, see `gaps`. Independently of the rule, the
objects stand in naming axes (`frames`): the camera's own, as in the paper, or gravity-up ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ros_scenesense.geometry import Float
from ros_scenesense.grounding import gaps, pyramids
from ros_scenesense.grounding.contact import seen_distances
from ros_scenesense.grounding.distances import closest_distances, distance_relations
from ros_scenesense.grounding.extent import Extent
from ros_scenesense.messages.grounding import Grounding

PYRAMIDS = "pyramids"
IMPROVED = "improved"


def ground_pairs(
    extents: Sequence[Extent],
    distances: Mapping[tuple[int, int], Float],
    viewpoint: Float,
    rule: str = IMPROVED,
) -> dict[tuple[int, int], Grounding]:
    """Position and distance relation of every directed pair.

    Args:
        extents: The located objects, all in the same naming axes.
        distances: Of the same objects: as `measure_distances` gives them for the same rule; in
            whichever axes.
        viewpoint: (3,) where the camera is, in the same axes as the objects.
        rule: `pyramids` or `improved`.

    Returns:
        Grounding of object i with respect to reference j, by (i, j).
    """
    if len(extents) < 2:
        return {}
    near = distance_relations(distances)
    by_pyramids = rule == PYRAMIDS
    places = pyramids.positions(extents) if by_pyramids else gaps.positions(extents, viewpoint)
    groundings = {}
    for (i, j), (position, confidence) in places.items():
        distance, distance_confidence = near[min(i, j), max(i, j)]
        groundings[i, j] = Grounding(
            position=position,
            position_confidence=confidence,
            distance=distance,
            distance_confidence=distance_confidence,
        )
    return groundings


def measure_distances(
    extents: Sequence[Extent], viewpoint: Float, rule: str = IMPROVED
) -> dict[tuple[int, int], Float]:
    """The closest distances of every unordered pair, by (i, j) with i < j; each (K,) metres.

    Args:
        extents: The located objects along the viewer's axes: what is hidden depends on them.
        viewpoint: (3,) where the camera is, in the same axes.
        rule: `pyramids` takes them between the clouds, as the paper does; `improved` only as far
            as the camera has seen them.
    """
    closest = closest_distances([extent.points for extent in extents])
    return closest if rule == PYRAMIDS else seen_distances(extents, closest, viewpoint)
