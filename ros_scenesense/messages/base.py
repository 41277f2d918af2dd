"""The envelope of every message, and the field types that messages share.

Every message travels as JSON in `std_msgs/String`. `schema` names the message and its version;
msgspec writes and checks it as the struct's tag.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

Name = Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
"""Name of an object, axiom, node or literal: any text, never used as program text."""

Identifier = Annotated[str, msgspec.Meta(min_length=1, max_length=128)]
"""A scene id `<session>-<index>`, or the id that joins a request to its answer."""

Text = Annotated[str, msgspec.Meta(max_length=4096)]
"""Words for people, or a formula in the domain's language (parsed, never run as text)."""

Probability = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**53 - 1)]
"""A number of things; up to what every JSON reader holds exactly."""

InstanceId = Annotated[int, msgspec.Meta(ge=1, le=65535)]
"""Value of an object's pixels in the instance image (16UC1); 0 is the background."""

Mode = Literal["training", "testing"]


class Stamp(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Time of the data a message speaks of, split as in `builtin_interfaces/Time`.

    Two integers, because a JSON number cannot hold nanoseconds since 1970 exactly everywhere.
    """

    sec: Annotated[int, msgspec.Meta(ge=0, lt=2**31)]
    nanosec: Annotated[int, msgspec.Meta(ge=0, lt=1_000_000_000)]

    @classmethod
    def of(cls, nanoseconds: int) -> Stamp:
        """The stamp of a time in nanoseconds."""
        return cls(*divmod(nanoseconds, 1_000_000_000))

    @property
    def nanoseconds(self) -> int:
        """The time in nanoseconds."""
        return self.sec * 1_000_000_000 + self.nanosec


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Base of the structs inside messages."""


class AnyMessage(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="schema"
):
    """Base of all messages, each of which has a topic of its own in `topics.py`."""


class Message(AnyMessage, frozen=True, kw_only=True, tag_field="schema"):
    """Base of what nodes publish. `stamp` is the time of the data, kept through the chain."""

    stamp: Stamp


class SceneMessage(Message, frozen=True, kw_only=True, tag_field="schema"):
    """Base of messages about one scene; joins are made on `scene_id`."""

    scene_id: Identifier


class HumanMessage(AnyMessage, frozen=True, kw_only=True, tag_field="schema"):
    """Base of what a person publishes: `schema`, `stamp` and `id` may be left out.

    Without an `id` a duplicate is recognised by its content.
    """

    stamp: Stamp | None = None
    id: Annotated[str, msgspec.Meta(max_length=128)] = ""
