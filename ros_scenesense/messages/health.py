"""Liveness of the nodes."""

from __future__ import annotations

from ros_scenesense.messages.base import Count, Message, Name


class Heartbeat(Message, frozen=True, tag="heartbeat/1"):
    """A node is alive; `stamp` is the time of sending (a killed node stays in the ROS graph).

    `ready` = its subscriptions are up. `counters` are its diagnostics since it started.
    """

    node: Name
    process_id: Count
    ready: bool
    warm: bool
    counters: dict[Name, Count]
