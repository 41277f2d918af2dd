"""What of the objects' attributes is not given: estimators then depend on what they measure."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec
import numpy as np

from ros_scenesense.messages.scenes import KnownObject

ATTRIBUTES = ("size", "surface", "shape", "color")


def withhold(
    objects: Iterable[KnownObject], share: float, seed: int, index: int
) -> list[KnownObject]:
    """The objects, each attribute left out with the probability `share`.

    What is left out depends on the seed, the scene and the object's name alone: it stays the same
    while a robot acts in the scene, and with a larger share more is left out.

    Args:
        objects: With all that is known.
        share: From 0 to 1.
        seed: Seed of the series of scenes.
        index: Number of the scene in the series, in an episode of its first one.
    """
    return [_without(known, share, seed, index) for known in objects]


def _without(known: KnownObject, share: float, seed: int, index: int) -> KnownObject:
    rng = np.random.default_rng([seed, index, *b"withheld", *known.name.encode()])
    draws = rng.random(len(ATTRIBUTES))
    left_out = [name for name, draw in zip(ATTRIBUTES, draws, strict=True) if draw < share]
    return msgspec.structs.replace(known, **dict.fromkeys(left_out))
