"""The scenes that the reasoner has decided lately, as situations to plan in."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace

from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.messages.actions import Action
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.reasoning.described_scenes import KnownScene
from ros_scenesense.reasoning.facts import SceneFacts, SceneObject
from ros_scenesense.reasoning.situations import Situation

_KEPT_SCENES = 64
_KEPT_OBJECTS = 256


@dataclass(frozen=True)
class SeenScene:
    """A scene that the reasoner has decided.

    Attributes:
        scene: The message that announced it.
        facts: Its objects and their relations.
        domain: The knowledge in force, without objects.
        withheld: Ids of axioms that are switched off.
    """

    scene: Scene
    facts: SceneFacts
    domain: SystemDescription
    withheld: frozenset[str]

    @property
    def id(self) -> str:
        """Its scene id."""
        return self.scene.scene_id

    def shows_effect_of(self, action: Action) -> bool:
        """Whether it shows what an action has led to."""
        step = action.step + 1
        return self.scene.episode_id == action.episode_id and self.scene.step == step


class SeenScenes:
    """Remembers scenes, and objects as they were last seen: of one in the hand nothing is seen."""

    def __init__(self) -> None:
        self._scenes: OrderedDict[str, SeenScene] = OrderedDict()
        self._objects: OrderedDict[str, SceneObject] = OrderedDict()

    def add(self, seen: SeenScene) -> None:
        """Keeps a scene, and forgets the oldest."""
        self._scenes[seen.id] = seen
        self._objects |= {each.name: each for each in seen.facts.objects}
        while len(self._scenes) > _KEPT_SCENES:
            self._scenes.popitem(last=False)
        while len(self._objects) > _KEPT_OBJECTS:
            self._objects.popitem(last=False)

    def get(self, scene_id: str) -> SeenScene | None:
        """A scene; None if it was not seen, or is forgotten."""
        return self._scenes.get(scene_id)

    @property
    def newest(self) -> SeenScene | None:
        """The scene that was seen last."""
        return next(reversed(self._scenes.values()), None)

    def effect_of(self, action: Action) -> SeenScene | None:
        """The scene that shows what an action has led to, if it was seen."""
        return next((each for each in self._scenes.values() if each.shows_effect_of(action)), None)

    def situation(self, seen: SeenScene) -> Situation:
        """What planning starts from in a scene."""
        name, held = seen.scene.in_hand, None
        facts = seen.facts
        if name is not None:
            held = replace(self._objects.get(name, SceneObject(name)), located=True)
            facts = replace(facts, objects=tuple(o for o in facts.objects if o.name != name))
        return Situation(seen.domain, KnownScene(facts, held), seen.withheld, self._objects)
