"""The source topics of the graph in a bag: what a camera and people said, scene by scene.

All else in a session follows from them: they are played to nodes that are to decide anew.
"""

from __future__ import annotations

import struct
from collections import OrderedDict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from ros_scenesense.errors import MessageError
from ros_scenesense.messages.actions import ActionResult, Goal
from ros_scenesense.messages.base import AnyMessage, SceneMessage
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.grounding import Feedback
from ros_scenesense.messages.scenes import Labels, Scene
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.frames import TOPIC_OF_PART

_MESSAGES: tuple[type[AnyMessage], ...] = (Scene, Labels, Feedback, Goal, ActionResult)
_OF_A_SCENE: tuple[type[SceneMessage], ...] = (Scene, Labels)
_WINDOW_NS = 2_000_000_000
"""The messages of a scene are received within so much time of each other."""
_ENCAPSULATION = 4  # bytes before the fields of a serialised message

Recorded = tuple[str, int, bytes]


@dataclass
class SceneInputs:
    """What belongs to one stamp, or stands alone.

    Attributes:
        messages: Topic, time received, bytes; in order.
        scene_id: Of the scene; None for what is about none.
    """

    messages: list[Recorded] = field(default_factory=list)
    scene_id: str | None = None


class Inputs:
    """Knows the source topics below a namespace.

    Args:
        namespace: Of the graph when it was recorded.
    """

    def __init__(self, namespace: str) -> None:
        prefix = namespace.rstrip("/")
        self._frames = {f"{prefix}/{name}" for name in TOPIC_OF_PART.values()}
        self._json = {f"{prefix}/{TOPICS[message].name}": message for message in _MESSAGES}

    @property
    def topics(self) -> set[str]:
        """Full names of the source topics."""
        return self._frames | set(self._json)

    def by_scene(self, recorded: Iterable[Recorded]) -> Iterator[SceneInputs]:
        """Puts together what belongs to a scene: images, `scene` and `labels` have one stamp.

        What people said stands alone, behind the scenes that were shown before it.
        """
        waiting: OrderedDict[object, SceneInputs] = OrderedDict()
        for each in recorded:
            while waiting and each[1] - _begin_of(waiting) > _WINDOW_NS:
                yield waiting.popitem(last=False)[1]
            stamp_ns, scene_id = self._stamp_of(each) or (None, None)
            key = object() if stamp_ns is None else stamp_ns
            unit = waiting.setdefault(key, SceneInputs())
            unit.messages.append(each)
            unit.scene_id = scene_id or unit.scene_id
        yield from waiting.values()

    def _stamp_of(self, recorded: Recorded) -> tuple[int, str | None] | None:
        """The stamp of an image or of a message about a scene, with the scene if it is told."""
        topic, _, data = recorded
        if len(data) < _ENCAPSULATION + 8:
            return None
        if topic in self._frames:
            seconds, nanoseconds = struct.unpack_from("<iI", data, _ENCAPSULATION)
            return seconds * 1_000_000_000 + nanoseconds, None
        kind = self._json[topic]
        if kind not in _OF_A_SCENE:
            return None
        try:
            message = decode(text_of(data), kind)
        except MessageError:
            return None
        assert isinstance(message, SceneMessage)
        return message.stamp.nanoseconds, message.scene_id


def _begin_of(waiting: OrderedDict[object, SceneInputs]) -> int:
    return next(iter(waiting.values())).messages[0][1]


def text_of(data: bytes) -> str:
    """The text of a serialised `std_msgs/String`."""
    (length,) = struct.unpack_from("<I", data, _ENCAPSULATION)
    start = _ENCAPSULATION + 4
    return data[start : start + max(0, length - 1)].decode(errors="replace")
