"""Whether stability labels would be the same if they were made again, with other small pushes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ros_scenesense.scene import Truth
from ros_scenesense.simulation.dataset.record import SceneRecord
from ros_scenesense.simulation.stability import stability


@dataclass(frozen=True)
class Agreement:
    """Labels of objects made twice.

    Attributes:
        objects: Number of objects.
        kept: Of these, not ambiguous either time.
        agreed: Of the kept ones, with the same label.
    """

    objects: int
    kept: int
    agreed: int

    @property
    def share(self) -> float | None:
        """Share of the kept objects with the same label."""
        return self.agreed / self.kept if self.kept else None


def label_agreement(records: Iterable[SceneRecord], seed: int) -> Agreement:
    """Builds scenes again and tests them with other displacements.

    Args:
        records: The scenes, with their labels.
        seed: Seed of the displacements.

    Raises:
        SimulationError: If Bullet cannot be started.
    """
    from ros_scenesense.simulation.world import World

    objects = kept = agreed = 0
    world = World()
    try:
        for record in records:
            world.restore((placed.piece, placed.pose) for placed in record.placed)
            structures = [tuple(label.members) for label in record.structure_labels]
            rng = np.random.default_rng([seed, record.index, *b"agreement"])
            again = stability(world, structures, rng)
            pairs = [(label.stable, again[label.name]) for label in record.object_labels]
            sure = [pair for pair in pairs if Truth.AMBIGUOUS not in pair]
            objects += len(pairs)
            kept += len(sure)
            agreed += sum(one is other for one, other in sure)
    finally:
        world.close()
    return Agreement(objects, kept, agreed)
