"""Hands calls from other threads to the thread of the node's executor."""

from __future__ import annotations

import queue
from collections.abc import Callable

from rclpy.node import Node


class Mailbox:
    """Calls put in by any thread are made, in order, by the node's executor.

    Args:
        node: Its executor makes the calls.
    """

    def __init__(self, node: Node) -> None:
        self._calls: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._guard = node.create_guard_condition(self._deliver)

    def put(self, call: Callable[[], object]) -> None:
        """Queues a call and wakes the executor."""
        self._calls.put(call)
        self._guard.trigger()

    def _deliver(self) -> None:
        while not self._calls.empty():
            self._calls.get()()
