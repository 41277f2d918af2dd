"""What the bodies of the axioms say of every object of a scene, from where things truly are."""

from __future__ import annotations

from dataclasses import dataclass

from ros_scenesense.messages.scenes import ObjectLabel
from ros_scenesense.scene import Position, Size, Surface
from ros_scenesense.simulation.dataset.record import SceneRecord


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
    # What is in a container does not stand on its surface.
    inside = {
        (one.object, one.reference) for one in record.relations if one.position is Position.IN
    }
    below = dict(pair for pair in record.supports if pair not in inside)
    said = _positions(record)
    found = []
    for label in record.object_labels:
        chain = _chain(label.name, below)
        found.append(
            Situation(
                label=label,
                above=Position.ABOVE in said[label.name],
                behind=Position.BEHIND in said[label.name],
                tower_height=1 + len(chain),
                irregular_below=any(known[name].surface is Surface.IRREGULAR for name in chain),
                small_base=any(known[name].size is Size.SMALL for name in chain),
                large_on_small=bool(chain)
                and known[label.name].size is Size.LARGE
                and known[chain[0]].size is Size.SMALL,
            )
        )
    return found


def _positions(record: SceneRecord) -> dict[str, set[Position]]:
    """By name, in which relations an object stands to the others."""
    said: dict[str, set[Position]] = {known.name: set() for known in record.objects}
    for relation in record.relations:
        said[relation.object].add(relation.position)
        converse = relation.position.converse
        if converse is not None:
            said[relation.reference].add(converse)
    return said


def _chain(name: str, below: dict[str, str]) -> list[str]:
    """What an object stands on, directly and through others."""
    chain: list[str] = []
    while name in below and below[name] not in chain:
        name = below[name]
        chain.append(name)
    return chain
