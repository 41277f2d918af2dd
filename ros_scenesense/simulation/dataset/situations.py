"""What the bodies of the axioms say of every object of a scene, from where things truly are.

Directions are those of the viewer, gravity-up, from centre of mass to centre of mass: an object
stands to another in the relation of the axis along which it is farthest from it. *On* is what the
scene was built as.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float
from ros_scenesense.messages.scenes import ObjectLabel
from ros_scenesense.scene import Position, Size, Surface
from ros_scenesense.simulation.dataset.record import SceneRecord
from ros_scenesense.simulation.relations import naming_axes


@dataclass(frozen=True)
class Situation:
    """An object of a scene.

    Attributes:
        label: Its truth.
        above: Whether it is above some object.
        behind: Whether it is behind some object, as the viewer sees it.
        tower_height: Its level in its stack, 1 on the table.
        irregular_below: Whether it stands, directly or not, on an irregular surface.
        small_base: Whether it stands, directly or not, on a small object.
        large_on_small: Whether it is large and stands on a small object.
    """

    label: ObjectLabel
    above: bool
    behind: bool
    tower_height: int
    irregular_below: bool
    small_base: bool
    large_on_small: bool


def situations(record: SceneRecord) -> list[Situation]:
    """The situation of every object, in the order of the objects."""
    known = {one.name: one for one in record.objects}
    below = dict(record.supports)
    relations = positions(record)
    found = []
    for number, label in enumerate(record.object_labels):
        chain = _chain(label.name, below)
        said = set(relations[number])
        found.append(
            Situation(
                label=label,
                above=Position.ABOVE in said,
                behind=Position.BEHIND in said,
                tower_height=1 + len(chain),
                irregular_below=any(known[name].surface is Surface.IRREGULAR for name in chain),
                small_base=any(known[name].size is Size.SMALL for name in chain),
                large_on_small=bool(chain)
                and known[label.name].size is Size.LARGE
                and known[chain[0]].size is Size.SMALL,
            )
        )
    return found


def positions(record: SceneRecord) -> list[list[Position]]:
    """For every object its position relation to each of the others."""
    centres = np.array([placed.pose.position for placed in record.placed]).reshape(-1, 3)
    local = centres @ naming_axes(record.camera_pose).T
    return [
        [_position(local[i] - local[j]) for j in range(len(local)) if i != j]
        for i in range(len(local))
    ]


_DIRECTIONS = (
    (Position.RIGHT, Position.LEFT),
    (Position.BEHIND, Position.FRONT),
    (Position.ABOVE, Position.BELOW),
)


def _position(offset: Float) -> Position:
    axis = int(np.abs(offset).argmax())
    return _DIRECTIONS[axis][0 if offset[axis] > 0.0 else 1]


def _chain(name: str, below: dict[str, str]) -> list[str]:
    """What an object stands on, directly and through others."""
    chain: list[str] = []
    while name in below and below[name] not in chain:
        name = below[name]
        chain.append(name)
    return chain
