"""Names, definitions and quality of service of topics, as a bag keeps them."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from ros_scenesense.errors import BagError

_SECOND_NS = 1_000_000_000
# What DDS means by "no limit"; ROS writes it so into bags.
_FOR_EVER = QosTime(9223372036, 854775807)


@dataclass(frozen=True)
class BagTopic:
    """A topic of a bag.

    Attributes:
        name: Full name.
        type: e.g. `std_msgs/msg/String`.
        definition: The text of the message definition with all that it refers to.
        digest: Hash of the type (RIHS01), by which ROS compares types.
        qos: What the publishers offer.
    """

    name: str
    type: str
    definition: str
    digest: str
    qos: tuple[Qos, ...] = ()


def bag_topic(name: str, type: str, profiles: Sequence[QoSProfile]) -> BagTopic:
    """A topic with the definition of its type.

    Args:
        name: Full name.
        type: Of its messages.
        profiles: What its publishers offer.

    Raises:
        BagError: If the definition of the type is not known.
    """
    store = _typestore()
    if type not in store.fielddefs:
        raise BagError(f"topic {name} is of type {type}, whose definition is not known")
    definition, _ = store.generate_msgdef(type, ros_version=2)
    qos = tuple(dict.fromkeys(map(_kept, profiles)))
    return BagTopic(name, type, definition, store.hash_rihs01(type), qos)


def digest_of(type: str) -> str:
    """The hash of a message type (RIHS01); empty if its definition is not known."""
    store = _typestore()
    return store.hash_rihs01(type) if type in store.fielddefs else ""


def message_class(type: str) -> Any:
    """The Python class of a message type.

    Raises:
        BagError: If no such class is installed.
    """
    package, _, rest = type.partition("/")
    kind, _, name = rest.partition("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise BagError(f"message type {type} is not installed: {error}") from error


def profile_to_hear(profiles: Sequence[QoSProfile], depth: int) -> QoSProfile:
    """The best profile of a subscription that takes all these publishers.

    Latched messages reach it only if all publishers latch them, and a best-effort publisher only a
    best-effort subscription.
    """
    latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in profiles)
    reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in profiles)
    return QoSProfile(
        depth=depth,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
    )


def profile_to_play(offered: Sequence[Qos], depth: int) -> QoSProfile:
    """The profile of a publisher that plays a topic: what was offered when it was recorded."""
    latched = any(each.durability is QosDurability.TRANSIENT_LOCAL for each in offered)
    best_effort = bool(offered) and all(
        each.reliability is QosReliability.BEST_EFFORT for each in offered
    )
    return QoSProfile(
        depth=depth,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
    )


@cache
def _typestore() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


def _kept(profile: QoSProfile) -> Qos:
    # The depth is the publisher's own affair: DDS does not tell it to others.
    history = {HistoryPolicy.KEEP_LAST: QosHistory.KEEP_LAST}.get(
        profile.history, QosHistory.UNKNOWN
    )
    reliability = {
        ReliabilityPolicy.RELIABLE: QosReliability.RELIABLE,
        ReliabilityPolicy.BEST_EFFORT: QosReliability.BEST_EFFORT,
    }.get(profile.reliability, QosReliability.UNKNOWN)
    durability = {
        DurabilityPolicy.TRANSIENT_LOCAL: QosDurability.TRANSIENT_LOCAL,
        DurabilityPolicy.VOLATILE: QosDurability.VOLATILE,
    }.get(profile.durability, QosDurability.UNKNOWN)
    liveliness = {
        LivelinessPolicy.AUTOMATIC: QosLiveliness.AUTOMATIC,
        LivelinessPolicy.MANUAL_BY_TOPIC: QosLiveliness.MANUAL_BY_TOPIC,
    }.get(profile.liveliness, QosLiveliness.UNKNOWN)
    return Qos(
        history=history,
        depth=profile.depth,
        reliability=reliability,
        durability=durability,
        deadline=_time(profile.deadline),
        lifespan=_time(profile.lifespan),
        liveliness=liveliness,
        liveliness_lease_duration=_time(profile.liveliness_lease_duration),
        avoid_ros_namespace_conventions=False,
    )


def _time(duration: Duration) -> QosTime:
    seconds, nanoseconds = divmod(duration.nanoseconds, _SECOND_NS)
    return min(QosTime(seconds, nanoseconds), _FOR_EVER)
