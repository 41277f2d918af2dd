"""The qualitative spatial representation: a fixed meaning of the prepositions, by one of two rules.

Paper, section *Qualitative Spatial Representation*. The rule `pyramids` is the paper's, see
`pyramids`; `improved` measures gaps between boxes, see `gaps`. Independently of the rule, the
objects stand in naming axes (`frames`): the camera's own, as in the paper, or gravity-up ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ros_scenesense.geometry import Float
from ros_scenesense.grounding import gaps, pyramids
from ros_scenesense.grounding.distances import distance_relations
from ros_scenesense.grounding.extent import Extent
from ros_scenesense.messages.grounding import Grounding

PYRAMIDS = "pyramids"
IMPROVED = "improved"


def ground_pairs(
    extents: Sequence[Extent],
    closest: Mapping[tuple[int, int], Float],
    seen_gaps: Float | None = None,
    rule: str = IMPROVED,
) -> dict[tuple[int, int], Grounding]:
    """Position and distance relation of every directed pair.

    Args:
        extents: The located objects, all in the same naming axes.
        closest: As `distances.closest_distances` gives them for the same objects.
        seen_gaps: (n, n) from `contact.seen_gaps`: stacked objects touch unless a gap was seen.
            The rule `pyramids` takes no notice. None gives the paper's distances alone.
        rule: `pyramids` or `improved`.

    Returns:
        Grounding of object i with respect to reference j, by (i, j).
    """
    if len(extents) < 2:
        return {}
    by_pyramids = rule == PYRAMIDS
    distances = distance_relations(closest, None if by_pyramids else seen_gaps)
    positions = pyramids.positions(extents) if by_pyramids else gaps.positions(extents)
    groundings = {}
    for (i, j), (position, confidence) in positions.items():
        distance, distance_confidence = distances[min(i, j), max(i, j)]
        groundings[i, j] = Grounding(
            position=position,
            position_confidence=confidence,
            distance=distance,
            distance_confidence=distance_confidence,
        )
    return groundings
