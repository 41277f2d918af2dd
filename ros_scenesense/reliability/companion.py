"""Lives with a graph under trial: asks for scenes, says how objects are related, keeps accounts."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import rclpy
from std_msgs.msg import String
from std_srvs.srv import Trigger

from ros_scenesense.errors import MessageError
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.base import AnyMessage, SceneMessage
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.grounding import Feedback, FeedbackResult, Relations
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.scenes import Scene, SceneLost
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.qos import profile_of

_KINDS: tuple[type[AnyMessage], ...] = (
    Scene,
    SceneLost,
    Relations,
    Estimates,
    FeedbackResult,
    Heartbeat,
)
_WRONG_WORDS = 0.1
_REPEAT_S = 3.0
_CALL_S = 5.0


@dataclass
class Account:
    """What was seen of a session.

    Attributes:
        shown: Ids of the scenes that the camera announced, in order.
        decided: Those that got their estimates.
        lost: Those that the camera reported as lost, with the reason.
        told: What was said, by id.
        answered: The answers to that.
        beats: Heartbeats by node.
        counters: Newest counters of each process, by node and process id.
        kept: All messages of the types that were asked for, in order, the first of an id alone.
    """

    shown: dict[str, None] = field(default_factory=dict)
    decided: set[str] = field(default_factory=set)
    lost: dict[str, str] = field(default_factory=dict)
    told: dict[str, Feedback] = field(default_factory=dict)
    answered: dict[str, FeedbackResult] = field(default_factory=dict)
    beats: Counter[str] = field(default_factory=Counter)
    counters: dict[tuple[str, int], Mapping[str, int]] = field(default_factory=dict)
    kept: dict[type[AnyMessage], dict[Any, AnyMessage]] = field(default_factory=dict)

    @property
    def waiting(self) -> list[str]:
        """Scenes that were neither decided nor reported as lost."""
        return [each for each in self.shown if each not in self.decided and each not in self.lost]

    @property
    def unanswered(self) -> list[str]:
        """Ids of what was said and not answered."""
        return [each for each in self.told if each not in self.answered]

    def total(self, node: str, counter: str) -> int:
        """What all processes of a node counted together."""
        return sum(
            counters.get(counter, 0)
            for (name, _), counters in self.counters.items()
            if name == node
        )


class Companion:
    """A node beside the graph.

    Args:
        seed: Of what is said about which objects.
        feedback_share: Share of the scenes that something is said about; a tenth of it is wrong.
        keep: Types of messages that are kept whole, besides what is counted.
        node_options: Passed on to `rclpy.create_node`: `context`, `namespace`.

    Attributes:
        node: For the caller's executor; the caller destroys it.
        account: What was seen.
    """

    def __init__(
        self,
        seed: int,
        feedback_share: float,
        keep: tuple[type[AnyMessage], ...] = (),
        **node_options: Any,
    ) -> None:
        self.node = rclpy.create_node("companion", **node_options)
        self.account = Account(kept={kind: {} for kind in keep})
        self._rng = np.random.default_rng([seed, *b"companion"])
        self._share = feedback_share
        self._said_at: dict[str, float] = {}
        self._asked_at = -float("inf")
        self._asking: Any = None
        for kind in dict.fromkeys((*_KINDS, *keep)):
            topic = TOPICS[kind]
            take = partial(self._take, kind)
            self.node.create_subscription(String, topic.name, take, profile_of(topic.qos))
        feedback = TOPICS[Feedback]
        self._feedback = self.node.create_publisher(String, feedback.name, profile_of(feedback.qos))
        self._next_scene = self.node.create_client(Trigger, "next_scene")

    def ask_for_scene(self) -> bool:
        """Asks the camera for one scene more; returns whether it could be asked."""
        pending = self._asking is not None and not self._asking.done()
        if pending and time.monotonic() - self._asked_at < _CALL_S:
            return False
        if not self._next_scene.service_is_ready():
            return False
        # A camera that was killed does not answer: its call is given up.
        self._asking = self._next_scene.call_async(Trigger.Request())
        self._asked_at = time.monotonic()
        return True

    def repeat_feedback(self) -> None:
        """Says again what was not answered: whoever was to answer may have been killed."""
        now = time.monotonic()
        for name in self.account.unanswered:
            if now - self._said_at[name] >= _REPEAT_S:
                self._say(self.account.told[name])

    def _take(self, kind: type[AnyMessage], received: String) -> None:
        try:
            message = decode(received.data, kind)
        except MessageError:
            return
        account = self.account
        if kind in account.kept:
            account.kept[kind].setdefault(_id_of(message), message)
        match message:
            case Scene():
                account.shown.setdefault(message.scene_id)
            case Estimates():
                account.decided.add(message.scene_id)
            case SceneLost():
                account.lost.setdefault(message.scene_id, message.reason)
            case FeedbackResult():
                account.answered.setdefault(message.id, message)
            case Heartbeat():
                account.beats[message.node] += 1
                account.counters[message.node, message.process_id] = message.counters
            case Relations():
                self._comment(message)

    def _comment(self, relations: Relations) -> None:
        """Says something about a pair of a new scene: now and then something wrong."""
        name = f"said-of-{relations.scene_id}"
        if name in self.account.told or not relations.relations:
            return
        if self._rng.random() >= self._share:
            return
        one = relations.relations[self._rng.integers(len(relations.relations))]
        pair = (one.object, one.reference)
        if self._rng.random() < _WRONG_WORDS:
            pair = (one.reference, one.object)
        feedback = Feedback(
            id=name,
            relation=one.position.value,
            object=pair[0],
            reference=pair[1],
            scene_id=relations.scene_id,
        )
        self.account.told[name] = feedback
        self._say(feedback)

    def _say(self, feedback: Feedback) -> None:
        self._said_at[feedback.id] = time.monotonic()
        self._feedback.publish(String(data=encode(feedback).decode()))


def _id_of(message: AnyMessage) -> Any:
    if isinstance(message, SceneMessage):
        return message.scene_id
    return getattr(message, "id", None) or encode(message)
