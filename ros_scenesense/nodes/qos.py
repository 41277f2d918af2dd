"""Quality of service of the topics, by what a topic is for (see `messages.topics.QosClass`)."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ros_scenesense.messages.topics import QosClass

# Best effort lost most images between processes on one host; a real driver may offer no more.
_DEPTH = {QosClass.FRAME: 5, QosClass.EVENT: 200, QosClass.STATE: 1, QosClass.REQUEST: 50}
_LATCHED = (QosClass.EVENT, QosClass.STATE)


def profile_of(qos: QosClass, reliability: str = "reliable") -> QoSProfile:
    """The profile of a class; both sides of a topic use the same.

    Args:
        qos: What the topic is for.
        reliability: `best_effort` where a camera driver publishes no better.
    """
    best_effort = reliability == "best_effort"
    return QoSProfile(
        depth=_DEPTH[qos],
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if qos in _LATCHED else DurabilityPolicy.VOLATILE
        ),
    )
