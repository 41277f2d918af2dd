"""Scenes to reason about that somebody described or recorded, rather than the camera showed.

A description names the objects, and what is known of how they stand to each other:

    objects:
      duck: {surface: irregular}
      white_cube: {size: medium, surface: flat}
      red_can:
    relations: ["on(duck, white_cube)", "on(white_cube, red_can)"]
    in_hand: null

What it does not say follows from the stacks: whoever stands on an object is above all that carries
it; stacks stand apart, from left to right in the order in which their lowest objects are named. A
recording holds the messages `objects`, `relations` and perhaps `scene` of a scene as the graph
published them. `docs/planning.md` explains both.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import yaml

from ros_scenesense.errors import MessageError, ReasoningError
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.grounding import Objects, PerceivedObject, Relation, Relations
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject
from ros_scenesense.scene import Distance, Position, Size, Surface

GIVEN = "given"
"""Source of what a description says."""

TABLE = "table"
"""What objects stand on that stand on no object."""


@dataclass(frozen=True)
class KnownScene:
    """A scene to reason about.

    Attributes:
        facts: Its objects and their relations.
        held: The object in the robot's hand, which is not among them; None if the hand is empty.
    """

    facts: SceneFacts
    held: SceneObject | None = None


class DescribedObject(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a description says of an object; None = unknown."""

    size: Size | None = None
    surface: Surface | None = None
    located: bool = True


class Description(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of a file that describes a scene."""

    objects: dict[str, DescribedObject | None]
    relations: list[str] = []
    in_hand: str | None = None


def read_content(path: Path) -> Mapping[str, Any]:
    """The content of a YAML or JSON file that holds a mapping.

    Raises:
        ReasoningError: If it cannot be read or holds something else.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeError) as error:
        raise ReasoningError(f"scene {path} cannot be read: {error}") from error
    except (yaml.YAMLError, RecursionError) as error:
        words = " ".join(str(error).split())
        raise ReasoningError(f"scene {path} is no YAML or JSON: {words}") from error
    if not isinstance(content, dict) or "objects" not in content:
        raise ReasoningError(
            f"scene {path} has no 'objects': describe the scene by 'objects' and 'relations', or "
            "give the messages of one"
        )
    return content


def is_recorded(content: Mapping[str, Any]) -> bool:
    """Whether a file holds messages rather than a description."""
    objects = content["objects"]
    return isinstance(objects, dict) and "schema" in objects


def described_scene(content: Mapping[str, Any], source: str) -> KnownScene:
    """The scene that a description tells of.

    Args:
        content: As read from a file.
        source: Where it comes from, for messages.

    Raises:
        ReasoningError: If it says something wrong; the text names the place.
    """
    try:
        described = msgspec.convert(content, Description)
    except msgspec.ValidationError as error:
        raise ReasoningError(f"scene {source}: {error}") from error
    objects = {
        name: SceneObject(name, each.located, each.size, each.surface, GIVEN, GIVEN)
        for name, each in ((n, each or DescribedObject()) for n, each in described.objects.items())
    }
    for name in objects:
        if not 0 < len(name) <= 64 or name == TABLE:
            raise ReasoningError(
                f"scene {source}: an object is called {name!r}: a name has 1 to 64 letters and is "
                f"not '{TABLE}'"
            )
    held = None
    if described.in_hand is not None:
        if described.in_hand not in objects:
            raise ReasoningError(f"scene {source}: $.in_hand is no object of the scene")
        held = objects.pop(described.in_hand)
    pairs = _Pairs(objects, source)
    for number, text in enumerate(described.relations):
        pairs.say(text, f"$.relations[{number}]")
    return KnownScene(SceneFacts(tuple(objects.values()), tuple(pairs.relations())), held)


def recorded_scene(content: Mapping[str, Any], source: str) -> KnownScene:
    """The scene that its messages tell of.

    Args:
        content: `objects`, `relations` and perhaps `scene`, each a message.
        source: Where it comes from, for messages.

    Raises:
        ReasoningError: If a message is missing or wrong.
    """
    found: dict[str, Any] = {}
    for name, kind in (("objects", Objects), ("relations", Relations), ("scene", Scene)):
        if name in content:
            try:
                found[name] = decode(msgspec.json.encode(content[name]), kind)
            except (MessageError, TypeError) as error:
                raise ReasoningError(f"scene {source}: {name}: {error}") from error
        elif name != "scene":
            raise ReasoningError(f"scene {source}: the message '{name}' is missing")
    ids = {message.scene_id for message in found.values()}
    if len(ids) > 1:
        raise ReasoningError(f"scene {source}: the messages are of several scenes: {sorted(ids)}")
    objects, relations = found["objects"], found["relations"]
    facts, problems = SceneFacts.checked(
        map(perceived_object, objects.objects),
        map(perceived_relation, relations.relations),
    )
    if problems:
        raise ReasoningError(f"scene {source}: {problems[0].words}")
    scene: Scene | None = found.get("scene")
    in_hand = scene.in_hand if scene is not None else None
    return KnownScene(facts, SceneObject(in_hand) if in_hand else None)


def perceived_object(each: PerceivedObject) -> SceneObject:
    """An object as grounding perceived it."""
    return SceneObject(
        each.name,
        located=each.box is not None,
        size=each.size.value if each.size else None,
        surface=each.surface.value if each.surface else None,
        size_source=each.size.source if each.size else "",
        surface_source=each.surface.source if each.surface else "",
    )


def perceived_relation(each: Relation) -> PairRelation:
    """The relations of a pair as control settled on them."""
    return PairRelation(
        each.object,
        each.reference,
        # Which object hides which is a matter of the viewer, whose axes ever name the directions.
        each.viewer_position or each.position,
        each.distance,
        each.position_confidence,
        each.distance_confidence,
        each.position_source,
        each.distance_source,
    )


class _Pairs:
    """The relations of a description, and those that follow from its stacks."""

    def __init__(self, objects: Mapping[str, SceneObject], source: str) -> None:
        self._names = tuple(objects)
        self._located = {name for name, each in objects.items() if each.located}
        self._source = source
        self._positions: dict[frozenset[str], tuple[str, str, Position]] = {}
        self._distances: dict[frozenset[str], Distance] = {}
        self._lower: dict[str, list[str]] = {}

    def say(self, text: str, where: str) -> None:
        """Takes a relation such as `behind(mug, box)`.

        Raises:
            ReasoningError: If it is none, or contradicts another.
        """
        match = _RELATION.fullmatch(text)
        if match is None:
            raise self._wrong(where, text, f"expected relation(object, reference) with {_KNOWN}")
        relation, one, other = match.groups()
        if relation != "on" and relation not in {**_POSITIONS, **_DISTANCES}:
            raise self._wrong(where, text, f"{relation!r} is none of {_KNOWN}")
        if relation == "on" and other == TABLE and one in self._names:
            return
        for name in (one, other):
            if name not in self._names:
                known = ", ".join(self._names)
                raise self._wrong(where, text, f"{name!r} is none of the objects {known}")
        if one == other:
            raise self._wrong(where, text, "an object stands in no relation to itself")
        if relation == "on":
            self._lower.setdefault(one, []).append(other)
        position = Position.ABOVE if relation == "on" else _POSITIONS.get(relation)
        distance = Distance.TOUCHING if relation == "on" else _DISTANCES.get(relation)
        if position is not None:
            self._place(one, other, position, where, text)
        if distance is not None:
            pair = frozenset((one, other))
            if self._distances.setdefault(pair, distance) is not distance:
                raise self._wrong(where, text, "it contradicts another relation of the two")

    def relations(self) -> Iterable[PairRelation]:
        """One relation for every pair of located objects, and for those that were named."""
        stack = self._stacks()
        for index, one in enumerate(self._names):
            for other in self._names[index + 1 :]:
                pair = frozenset((one, other))
                named = self._positions.get(pair)
                if named is None and not pair <= self._located:
                    continue
                if named is None:
                    named = self._by_stacks(one, other, stack)
                upper, lower, position = named
                distance = self._distances.get(pair, Distance.NOT_TOUCHING)
                yield PairRelation(
                    upper, lower, position, distance, position_source=GIVEN, distance_source=GIVEN
                )

    def _place(self, one: str, other: str, position: Position, where: str, text: str) -> None:
        pair = frozenset((one, other))
        known = self._positions.get(pair)
        said = {(one, other, position), (other, one, position.converse)}
        if known is not None and known not in said:
            raise self._wrong(where, text, "it contradicts another relation of the two")
        self._positions[pair] = (one, other, position)

    def _by_stacks(
        self, one: str, other: str, stack: Mapping[str, int]
    ) -> tuple[str, str, Position]:
        if other in self._carriers(one):
            return one, other, Position.ABOVE
        if one in self._carriers(other):
            return other, one, Position.ABOVE
        position = Position.LEFT if stack[one] <= stack[other] else Position.RIGHT
        return one, other, position

    def _stacks(self) -> dict[str, int]:
        """Number of the stack of each object, by its lowest object."""
        stack = {}
        for name in self._names:
            lowest = min(
                (each for each in {name, *self._carriers(name)} if not self._lower.get(each)),
                key=self._names.index,
                default=name,
            )
            stack[name] = self._names.index(lowest)
        return stack

    def _carriers(self, name: str) -> set[str]:
        """Everything that the object stands on, directly or through others."""
        found: set[str] = set()
        waiting = [name]
        while waiting:
            fresh = [each for each in self._lower.get(waiting.pop(), ()) if each not in found]
            found.update(fresh)
            waiting.extend(fresh)
        return found

    def _wrong(self, where: str, text: str, words: str) -> ReasoningError:
        shown = text if len(text) <= 80 else f"{text[:80]}…"
        return ReasoningError(f"scene {self._source}: {where} is {shown!r}: {words}")


_RELATION = re.compile(r"\s*(\w+)\s*\(\s*([^,()]+?)\s*,\s*([^,()]+?)\s*\)\s*\.?\s*")
_POSITIONS = {member.value: member for member in Position}
_DISTANCES = {member.value: member for member in Distance}
_KNOWN = ", ".join(("on", *_POSITIONS, *_DISTANCES))
