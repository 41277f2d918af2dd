"""How sure a share is, and whether two shares differ."""

from __future__ import annotations

import math
from functools import lru_cache


def lower_bound(hits: int, count: int, z: float) -> float:
    """Wilson's lower bound of a share of which `hits` of `count` were seen; 0 of nothing."""
    if count == 0:
        return 0.0
    share = hits / count
    centre = share + z * z / (2 * count)
    spread = z * math.sqrt(share * (1.0 - share) / count + z * z / (4 * count * count))
    return (centre - spread) / (1.0 + z * z / count)


@lru_cache(maxsize=1 << 16)
def belief(hits: int, count: int, least: float) -> float:
    """The probability that a share is at least `least`, of which `hits` of `count` were seen.

    Before anything was seen every share is equally likely; after it the share has a beta
    distribution, whose tail is a sum over as many terms as there are misses.
    """
    if not 0.0 < least < 1.0:
        return float(least <= 0.0)
    misses, log_odds = count - hits, math.log(1.0 - least) - math.log(least)
    term = (count + 1) * math.log(least)
    below = 0.0
    for number in range(misses + 1):
        below += math.exp(term)
        term += math.log(count + 1 - number) - math.log(number + 1) + log_odds
    return max(0.0, 1.0 - below)


def difference(hits: int, count: int, other_hits: int, other_count: int) -> float:
    """By how many standard deviations the first share is above the other, pooled; 0 of nothing."""
    if count == 0 or other_count == 0:
        return 0.0
    pooled = (hits + other_hits) / (count + other_count)
    variance = pooled * (1.0 - pooled) * (1.0 / count + 1.0 / other_count)
    if variance == 0.0:
        return 0.0
    return (hits / count - other_hits / other_count) / math.sqrt(variance)
