"""Which scene of a dataset shall be what, so that labels are balanced.

A network that sees tall stacks fall and low ones stand learns height, not stability. So every
number of objects in a stack gets its own share of unstable stacks, in every arrangement. The plan
follows from the seed and the number of the scene alone, never from what was made before.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from ros_scenesense.simulation.arrangements import Arrangement
from ros_scenesense.simulation.wish import ANY, Wish


class Draw(StrEnum):
    """How scenes are drawn: with balanced labels, or as the arrangement gives them."""

    BALANCED = "balanced"
    NATURAL = "natural"


UNSTABLE_OF_20 = {2: 10, 3: 10, 4: 10, 5: 17}
"""Of twenty stacks of so many objects, how many are unstable in a balanced dataset."""

STACKED = {Arrangement.TOWERS: (2, 3, 4, 5), Arrangement.INTERSECTION: (2, 3, 4)}
"""How many objects a stack of the arrangement has; other arrangements have none."""


def wish_for(draw: Draw, arrangement: Arrangement, seed: int, index: int) -> Wish:
    """What the scene of this number must be like.

    Args:
        draw: How scenes are drawn.
        arrangement: Of the dataset; `mixed` takes towers, spread and intersection in turn.
        seed: Seed of the dataset.
        index: Number of the scene.
    """
    if draw is Draw.NATURAL:
        return ANY
    number = index
    if arrangement is Arrangement.MIXED:
        number, turn = divmod(index, len(_IN_TURN))
        arrangement = _IN_TURN[turn]
    if arrangement not in STACKED:
        return Wish(arrangement)
    # A block holds every kind of stack exactly as often as it must, in an order of its own.
    block = _block(arrangement)
    number, place = divmod(number, len(block))
    order = np.random.default_rng([seed, number, *str(arrangement).encode()])
    stacked, stable = block[int(order.permutation(len(block))[place])]
    return Wish(arrangement, stacked, stable)


_IN_TURN = (Arrangement.TOWERS, Arrangement.SPREAD, Arrangement.INTERSECTION)


def _block(arrangement: Arrangement) -> list[tuple[int, bool]]:
    return [
        (stacked, place >= UNSTABLE_OF_20[stacked])
        for stacked in STACKED[arrangement]
        for place in range(20)
    ]
