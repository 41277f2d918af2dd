"""How sure a share is, and whether two shares differ."""

from __future__ import annotations

import math


def lower_bound(hits: int, count: int, z: float) -> float:
    """Wilson's lower bound of a share of which `hits` of `count` were seen; 0 of nothing."""
    if count == 0:
        return 0.0
    share = hits / count
    centre = share + z * z / (2 * count)
    spread = z * math.sqrt(share * (1.0 - share) / count + z * z / (4 * count * count))
    return (centre - spread) / (1.0 + z * z / count)


def difference(hits: int, count: int, other_hits: int, other_count: int) -> float:
    """By how many standard deviations the first share is above the other, pooled; 0 of nothing."""
    if count == 0 or other_count == 0:
        return 0.0
    pooled = (hits + other_hits) / (count + other_count)
    variance = pooled * (1.0 - pooled) * (1.0 / count + 1.0 / other_count)
    if variance == 0.0:
        return 0.0
    return (hits / count - other_hits / other_count) / math.sqrt(variance)
