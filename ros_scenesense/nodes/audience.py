"""Who takes a topic: everybody but a recorder, which listens to all and acts on nothing."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.publisher import Publisher

from ros_scenesense.nodes.registry import RECORDER


def audience(node: Node, publisher: Publisher) -> int:
    """How many subscriptions that are not a recorder's are matched with a publisher of a node."""
    count: int = publisher.get_subscription_count()
    if count == 0:
        return 0
    takers = node.get_subscriptions_info_by_topic(publisher.topic_name)
    return max(0, count - sum(taker.node_name == RECORDER for taker in takers))
