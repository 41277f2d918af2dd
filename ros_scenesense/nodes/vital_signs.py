"""What a node says of itself: a heartbeat for the launcher, diagnostics for people and tools."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.qos import QoSProfile

from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.nodes.problem_log import ProblemLog
from ros_scenesense.stages.health import Health

WARN_FOR_S = 10.0


class VitalSigns:
    """Makes heartbeat and `/diagnostics` of one node.

    Attributes:
        ready: Whether the node's subscriptions are up.
        warm: Whether its worker takes jobs at once; True for a node without a worker.
        worker_failure: Why the worker does not start; None while it may.
    """

    def __init__(
        self, node: Node, health: Health, problems: ProblemLog, publish: Callable[[Heartbeat], None]
    ) -> None:
        self.ready = False
        self.warm = False
        self.worker_failure: str | None = None
        self._node = node
        self._health = health
        self._problems = problems
        self._publish = publish
        self._diagnostics = node.create_publisher(
            DiagnosticArray, "/diagnostics", QoSProfile(depth=10)
        )

    def send_heartbeat(self) -> None:
        """Publishes that the node is alive."""
        heartbeat = Heartbeat(
            stamp=Stamp.of(self._node.get_clock().now().nanoseconds),
            node=self._node.get_name(),
            process_id=os.getpid(),
            ready=self.ready,
            warm=self.warm,
            counters=dict(self._health.counters),
        )
        self._publish(heartbeat)

    def send_diagnostics(self) -> None:
        """Publishes the node's state in the form of the ROS diagnostic tools."""
        level, summary = self._state()
        values = [
            KeyValue(key=name, value=str(count)) for name, count in self._health.counters.items()
        ]
        values.append(KeyValue(key="last_problem", value=self._health.last_problem or ""))
        status = DiagnosticStatus(
            level=level,
            name=f"{self._node.get_fully_qualified_name()}: health",
            message=summary,
            hardware_id=socket.gethostname(),
            values=values,
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def _state(self) -> tuple[bytes, str]:
        if self.worker_failure is not None:
            return DiagnosticStatus.ERROR, self.worker_failure
        if self._problems.age_s() < WARN_FOR_S:
            return DiagnosticStatus.WARN, self._health.last_problem or "a problem was reported"
        return DiagnosticStatus.OK, "running" if self.warm else "warming up"
