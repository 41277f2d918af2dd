"""Simulated scenes as they truly are, for reasoning: not as a camera sees them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_scenesense.reasoning.described_scenes import GIVEN, KnownScene
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject

if TYPE_CHECKING:
    from ros_scenesense.simulation.engine import SimulatedScene


def true_scene(scene: SimulatedScene) -> KnownScene:
    """All attributes and relations of a simulated scene."""
    facts, _ = SceneFacts.checked(
        (
            SceneObject(each.name, True, each.size, each.surface, GIVEN, GIVEN)
            for each in scene.objects
        ),
        (
            PairRelation(
                each.object,
                each.reference,
                each.position,
                each.distance,
                position_source=GIVEN,
                distance_source=GIVEN,
            )
            for each in scene.relations
        ),
    )
    return KnownScene(facts)
