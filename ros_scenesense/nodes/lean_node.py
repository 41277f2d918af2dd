"""A ROS node that gives its executor little to look after."""

from __future__ import annotations

from typing import Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription


class LeanNode(Node):
    """A node whose topics have no events unless somebody asks for them.

    By default every publisher and every subscription watches for neighbours with another quality of
    service or type. rclpy's executor collects all that is watched anew before it waits: for the
    two dozen topics of a node, that took most of its CPU time. Where strangers are expected, as
    with camera drivers, the event is asked for.
    """

    def create_publisher(self, *arguments: Any, **options: Any) -> Publisher:
        """As `Node.create_publisher`, without events unless `event_callbacks` are given."""
        options.setdefault("event_callbacks", PublisherEventCallbacks(use_default_callbacks=False))
        return super().create_publisher(*arguments, **options)

    def create_subscription(self, *arguments: Any, **options: Any) -> Subscription:
        """As `Node.create_subscription`, without events unless `event_callbacks` are given."""
        options.setdefault(
            "event_callbacks", SubscriptionEventCallbacks(use_default_callbacks=False)
        )
        return super().create_subscription(*arguments, **options)
