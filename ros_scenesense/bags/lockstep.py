"""Plays the inputs of a session scene by scene; compares what is decided with what was."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

from rclpy.node import Node
from std_msgs.msg import String

from ros_scenesense.bags.inputs import Inputs, SceneInputs, text_of
from ros_scenesense.bags.playing import Player
from ros_scenesense.bags.reading import BagDescription, read_messages
from ros_scenesense.errors import BagError, MessageError
from ros_scenesense.messages.attention import Estimate, Estimates, ObjectEstimate, StructureEstimate
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.reasoning import Belief, Beliefs, ObjectBelief, StructureBelief
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.qos import profile_of

_AUDIENCE_S = 15.0
Decided = Beliefs | Estimates
_KINDS: tuple[type[Decided], ...] = (Beliefs, Estimates)


@dataclass
class Comparison:
    """What became of the scenes that were played.

    Attributes:
        same: Scenes of which all is decided as it was recorded.
        different: Scenes of which something is decided otherwise, each with the first difference.
        undecided: Scenes that got no decision in time.
        new: Scenes of which the bag holds no decision.
        other_revisions: Scenes decided with other knowledge, trust or another network.
    """

    same: list[str] = field(default_factory=list)
    different: dict[str, str] = field(default_factory=dict)
    undecided: list[str] = field(default_factory=list)
    new: list[str] = field(default_factory=list)
    other_revisions: list[str] = field(default_factory=list)

    def judge(
        self, scene_id: str, recorded: Sequence[Decided | None], heard: Sequence[Decided]
    ) -> None:
        """Compares the messages about a scene with the recorded ones, kind by kind.

        Args:
            scene_id: The scene.
            recorded: None where the bag has none.
            heard: In the same order.
        """
        pairs = [(before, now) for before, now in zip(recorded, heard, strict=True) if before]
        if len(pairs) < len(heard):
            self.new.append(scene_id)
            return
        if any(_revisions(before) != _revisions(now) for before, now in pairs):
            self.other_revisions.append(scene_id)
        differences = [words for before, now in pairs if (words := _difference(before, now))]
        if differences:
            self.different[scene_id] = differences[0]
        else:
            self.same.append(scene_id)


class Lockstep:
    """Plays a scene, waits for its decisions, and plays the next.

    Args:
        node: Hears the decisions.
        player: Plays the source topics.
        bag: Its bag.
        inputs: Which topics these are.
        timeout_s: How long the decisions about a scene are waited for.
    """

    def __init__(
        self, node: Node, player: Player, bag: BagDescription, inputs: Inputs, timeout_s: float
    ) -> None:
        self._player, self._bag, self._inputs = player, bag, inputs
        self._timeout_s = timeout_s
        self._heard: dict[type[Decided], dict[str, Decided]] = {}
        self._names: dict[type[Decided], str] = {}
        for kind in _KINDS:
            topic = TOPICS[kind]
            self._heard[kind] = {}
            self._names[kind] = node.resolve_topic_name(topic.name)
            take = partial(self._take, kind)
            node.create_subscription(String, topic.name, take, profile_of(topic.qos))
        self._scene_topic = node.resolve_topic_name(TOPICS[Scene].name)

    def run(self) -> Comparison:
        """Plays all scenes.

        Raises:
            BagError: If nobody takes the scenes.
        """
        if not self._player.wait_for_audience(self._scene_topic, _AUDIENCE_S):
            raise BagError(
                f"nobody takes {self._scene_topic} within {_AUDIENCE_S:g} s: start the graph "
                "without its camera, `scenesense launch --nodes grounding grounding_control "
                "reasoner attention axiom_learner`, with the same --namespace and --domain-id"
            )
        self._player.wait_for_quiet()
        recorded = {kind: self._recorded(kind) for kind in _KINDS}
        comparison = Comparison()
        done: set[str] = set()
        for unit in self._inputs.by_scene(self._player.messages):
            if self._player.stopped:
                break
            self._player.publish(unit.messages)
            scene_id = unit.scene_id
            if scene_id is None or scene_id in done:
                continue
            done.add(scene_id)
            if not self._wait_for(unit):
                comparison.undecided.append(scene_id)
                continue
            comparison.judge(
                scene_id,
                [recorded[kind].get(scene_id) for kind in _KINDS],
                [self._heard[kind][scene_id] for kind in _KINDS],
            )
        return comparison

    def _wait_for(self, unit: SceneInputs) -> bool:
        return self._player.spin_until(
            lambda: all(unit.scene_id in heard for heard in self._heard.values()), self._timeout_s
        )

    def _recorded(self, kind: type[Decided]) -> dict[str, Decided]:
        found: dict[str, Decided] = {}
        topic = self._names[kind]
        for _, _, data in read_messages(self._bag.folder, lambda name: name == topic):
            try:
                message = decode(text_of(data), kind)
            except MessageError:
                continue
            found.setdefault(message.scene_id, message)
        return found

    def _take(self, kind: type[Decided], received: String) -> None:
        try:
            message = decode(received.data, kind)
        except MessageError:
            return
        self._heard[kind].setdefault(message.scene_id, message)


def _revisions(message: Decided) -> tuple[object, ...]:
    network = message.network_revision if isinstance(message, Estimates) else None
    return message.knowledge_revision, message.trust_revision, network


def _difference(before: Decided, now: Decided) -> str:
    """The first decision that differs, in words; empty if none does."""
    for one, other in zip(_decisions(before), _decisions(now), strict=False):
        if one != other:
            return f"{one[0]}: recorded {one[1]}, now {other[1]}"
    if len(list(_decisions(before))) != len(list(_decisions(now))):
        return "there are other objects or structures"
    return ""


def _decisions(message: Decided) -> Iterable[tuple[str, str]]:
    """What was decided, each named by its subject, in order."""
    objects: list[ObjectBelief | ObjectEstimate] = [*message.objects]
    structures: list[StructureBelief | StructureEstimate] = [*message.structures]
    for each in sorted(objects, key=lambda one: one.name):
        yield f"stable({each.name})", _words(each.stable)
        yield f"occluded({each.name})", _words(each.occluded)
    for structure in sorted(structures, key=lambda one: one.members):
        yield f"stable({', '.join(structure.members)})", _words(structure.stable)


def _words(decision: Belief | Estimate) -> str:
    value = {True: "yes", False: "no", None: "open"}[decision.value]
    return f"{value} ({decision.status if isinstance(decision, Belief) else decision.source})"
