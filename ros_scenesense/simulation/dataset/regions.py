"""The paper's second dataset: labelled regions of interest, derived from the scenes of the first.

A region is a box about a group of objects. Nothing of it is stored: its pixels are those of the
scene, its labels those of the objects in it. Source: section *Occlusion and Stability Estimation*
of the paper's experimental set-up.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import DatasetError
from ros_scenesense.messages.scenes import ObjectLabel
from ros_scenesense.scene import Position, Task, Truth
from ros_scenesense.simulation.dataset.record import SceneRecord
from ros_scenesense.simulation.engine import SimulatedScene
from ros_scenesense.simulation.stability import structure_stability

MOST_OBJECTS = 5
"""Objects in a region at most."""

Group = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class LabelledRegion:
    """A region of interest with the truth about it.

    Attributes:
        members: Names of its objects, in the order of the scene.
        left: First column of its box in the scene's image.
        top: First row.
        color: (h, w, 3) uint8 RGB, the scene's pixels in the box.
        depth: (h, w) float32 metres; 0 where nothing was read.
        instances: (h, w) uint16 instance ids of the scene.
        labels: Truth about each member, in the order of `members`.
        stable: Whether the structure that they make is stable: false if a member surely is not,
            true if all surely are.
    """

    members: Group
    left: int
    top: int
    color: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    instances: npt.NDArray[np.uint16]
    labels: tuple[ObjectLabel, ...]
    stable: Truth


def labelled_regions(
    scene: SimulatedScene, groups: Iterable[Iterable[str]], margin: float = 0.05
) -> Iterator[LabelledRegion]:
    """The regions of groups of objects of a scene.

    Args:
        scene: A scene of a dataset, or a simulated one.
        groups: Names of the objects of each region, as an attention mechanism chooses them.
        margin: So many times its longer side a box is larger on every side, within the image.

    Raises:
        DatasetError: If a group is empty or has more than five objects, one of them is not in the
            scene, or the image shows none of them.
    """
    for group in groups:
        yield _region(scene, frozenset(group), margin)


def possible_groups(scene: SceneRecord | SimulatedScene) -> list[tuple[Task, Group]]:
    """The groups that the tasks of the paper ask about, whatever an estimator knows already.

    For stability every stack; for occlusion every object that is behind others, as the viewer
    sees it, together with these. Ambiguous relations count, as everywhere where axioms are judged.
    """
    stacks: list[tuple[Task, Group]] = [
        (Task.STABILITY, tuple(label.members))
        for label in scene.structure_labels
        if len(label.members) > 1
    ]
    nearer: dict[str, set[str]] = {}
    for relation in scene.relations:
        pair = relation.object, relation.reference
        if relation.position is Position.FRONT:
            pair = pair[1], pair[0]
        if relation.position in (Position.FRONT, Position.BEHIND):
            nearer.setdefault(pair[0], set()).add(pair[1])
    behind = [
        (Task.OCCLUSION, tuple(sorted({name, *others}))) for name, others in sorted(nearer.items())
    ]
    return [*stacks, *behind]


def region_label(labels: Iterable[ObjectLabel]) -> Truth:
    """Stability of the structure that objects in a region make, from their own."""
    stable = {label.name: label.stable for label in labels}
    return structure_stability(stable, stable)


def _region(scene: SimulatedScene, group: frozenset[str], margin: float) -> LabelledRegion:
    known = {one.name: one.instance for one in scene.objects}
    strangers = sorted(group - set(known))
    if strangers:
        raise DatasetError(
            f"{', '.join(strangers)}: not in the scene, which has {', '.join(known)}"
        )
    if not 1 <= len(group) <= MOST_OBJECTS:
        raise DatasetError(
            f"a region has 1 to {MOST_OBJECTS} objects, not {len(group)}: choose fewer or more"
        )
    instances = scene.frame.instances
    assert instances is not None
    rows, columns = np.nonzero(np.isin(instances, [known[name] for name in group]))
    if not rows.size:
        raise DatasetError(f"the image shows nothing of {', '.join(sorted(group))}")
    spare = round(margin * (1 + max(np.ptp(rows), np.ptp(columns))))
    top, left = max(0, int(rows.min()) - spare), max(0, int(columns.min()) - spare)
    part = slice(top, int(rows.max()) + spare + 1), slice(left, int(columns.max()) + spare + 1)
    labels = tuple(label for label in scene.object_labels if label.name in group)
    return LabelledRegion(
        members=tuple(label.name for label in labels),
        left=left,
        top=top,
        color=scene.frame.color[part],
        depth=scene.frame.depth[part],
        instances=instances[part],
        labels=labels,
        stable=region_label(labels),
    )
