"""Gives a stage its ROS side: parameters, JSON topics, timers, a worker, health reports.

The stage is called from the executor's thread only. What its worker process finishes comes through
a mailbox. A callback never raises: what goes wrong inside a stage is logged, counted, and the node
goes on.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.publisher import Publisher
from std_msgs.msg import Float32, String

from ros_scenesense.errors import MessageError, SceneSenseError
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.topics import TOPICS, QosClass
from ros_scenesense.nodes.audience import audience
from ros_scenesense.nodes.lean_node import LeanNode
from ros_scenesense.nodes.mailbox import Mailbox
from ros_scenesense.nodes.parameters import declare_configuration
from ros_scenesense.nodes.problem_log import ProblemLog
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.vital_signs import VitalSigns
from ros_scenesense.stages.protocol import Figure, Incoming, Job, Outgoing, Stage, Timing
from ros_scenesense.stages.worker import WorkerProcess

TICK_S = 0.1
HEARTBEAT_S = 0.5
DIAGNOSTICS_S = 1.0


class StageNode(LeanNode):
    """A node around one stage. Subclasses add image topics and services in `connect`.

    Args:
        name: Name of the node.
        configuration: Dataclass that declares the parameters.
        stage: Makes the stage from its configuration.
        subscribes: Messages that the stage takes.
        publishes: Messages that the stage gives.
        node_options: Passed on to `rclpy.node.Node`, e.g. `context`, `namespace`.

    Attributes:
        configuration: The values of the parameters.
        stage: The stage.
        health: Its counters and problems; the node adds its own.
        publish_as: How to publish each type of item; subclasses add theirs.

    Raises:
        SceneSenseError: If a parameter is wrong or the stage cannot be made.
    """

    def __init__(
        self,
        name: str,
        configuration: type[Any],
        stage: Callable[[Any], Stage],
        subscribes: Sequence[type[AnyMessage]] = (),
        publishes: Sequence[type[AnyMessage]] = (),
        **node_options: Any,
    ) -> None:
        super().__init__(name, **node_options)
        self._worker: WorkerProcess | None = None
        self._subscribes = tuple(subscribes)
        self._number_publishers: dict[str, Publisher] = {}
        self._seen_errors: set[tuple[str, int]] = set()
        # By the identity of a job: it lives until it is finished, and a key may come twice.
        self._handed_out: dict[int, float] = {}
        self.publish_as: dict[type[Any], Callable[[Any], None]] = {
            Timing: lambda one: self._publish_number(
                f"timing/{one.name}", one.milliseconds, QosClass.REQUEST
            ),
            Figure: lambda one: self._publish_number(
                f"figures/{one.name}", one.value, QosClass.STATE
            ),
        }
        try:
            self.configuration = declare_configuration(self, configuration)
            self.stage = stage(self.configuration)
        except SceneSenseError:
            super().destroy_node()
            raise
        self.health = self.stage.health
        self._problems = ProblemLog(self.health, self.get_logger().warning)
        self._mailbox = Mailbox(self)
        for message in publishes:
            self._open_publisher(message)
        self._open_publisher(Heartbeat)
        self.vital_signs = VitalSigns(self, self.health, self._problems, self.publish)
        self.connect()
        self._start()

    def connect(self) -> None:
        """Opens the subscriptions; subclasses extend it by their own topics and services."""
        for message in self._subscribes:
            topic = TOPICS[message]
            take = partial(self._take_json, message)
            self.create_subscription(String, topic.name, take, profile_of(topic.qos))

    def tick(self) -> None:
        """Gives the stage the time; subclasses may look at the graph first."""
        self.call(self.stage.tick)

    def take(self, item: Incoming) -> None:
        """Gives the stage what was received; subclasses may look at it first."""
        self.call(self.stage.handle, item)

    def call(self, method: Callable[..., list[Outgoing]], *arguments: Any) -> bool:
        """Calls a method of the stage with the time last, publishes what it gives, runs its jobs.

        Never raises for what happens inside; returns whether the method did its work.
        """
        now_ns = self.get_clock().now().nanoseconds
        outgoing = self._guarded(method, *arguments, now_ns)
        for item in outgoing or []:
            self.publish(item)
        for job in self._guarded(self.stage.jobs) or []:
            self._guarded(self._submit, job)
        self._problems.report()
        return outgoing is not None

    def publish(self, item: Outgoing) -> None:
        """Publishes one item; what cannot be sent is a problem, not an exception."""
        try:
            self.publish_as[type(item)](item)
        except MessageError as error:
            self.health.problem("not_sent", str(error))
        except Exception as error:
            self.internal_error(error)

    def internal_error(self, error: Exception) -> None:
        """Counts an exception that nobody expected; its traceback is logged once per place."""
        place = traceback.extract_tb(error.__traceback__)[-1]
        words = f"{type(error).__name__}: {error} ({place.filename}:{place.lineno})"
        self.health.problem("internal_error", f"internal error, the node goes on: {words}")
        if (place.filename, place.lineno or 0) not in self._seen_errors:
            self._seen_errors.add((place.filename, place.lineno or 0))
            self.get_logger().error("".join(traceback.format_exception(error)))

    def has_subscribers(self, *publishers: Publisher) -> bool:
        """Whether somebody takes every one of these topics; a recorder is nobody's audience."""
        return all(audience(self, publisher) > 0 for publisher in publishers)

    def destroy_node(self) -> None:
        """Stops the worker, closes the stage's files, leaves the graph."""
        if self._worker is not None:
            self._worker.close()
        self.stage.close()
        super().destroy_node()

    def _start(self) -> None:
        # Timers follow the steady clock: a node stays alive though simulated time stands still.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(TICK_S, self.tick, clock=steady)
        self.create_timer(HEARTBEAT_S, self.vital_signs.send_heartbeat, clock=steady)
        self.create_timer(DIAGNOSTICS_S, self.vital_signs.send_diagnostics, clock=steady)
        factory = self.stage.engine()
        if factory is not None:
            self._worker = WorkerProcess(
                factory, self._job_done, warm=self._worker_warm, failed=self._worker_failed
            )
        self.vital_signs.warm = self._worker is None
        self.vital_signs.ready = True
        self.vital_signs.send_heartbeat()
        self.call(self.stage.start)

    def _open_publisher(self, message: type[AnyMessage]) -> None:
        topic = TOPICS[message]
        publisher = self.create_publisher(String, topic.name, profile_of(topic.qos))
        self.publish_as[message] = lambda item: publisher.publish(
            String(data=encode(item).decode())
        )

    def _take_json(self, message: type[AnyMessage], received: String) -> None:
        try:
            item = decode(received.data, message)
        except MessageError as error:
            name = TOPICS[message].name
            self.health.problem(f"bad_{name}", f"message on '{name}' is ignored: {error}")
            self._problems.report()
            return
        self.take(item)

    def _publish_number(self, topic: str, value: float, qos: QosClass) -> None:
        publisher = self._number_publishers.get(topic)
        if publisher is None:
            publisher = self.create_publisher(Float32, topic, profile_of(qos))
            self._number_publishers[topic] = publisher
        # What nobody keeps for late comers need not be sent while nobody listens.
        if qos is not QosClass.REQUEST or publisher.get_subscription_count() > 0:
            publisher.publish(Float32(data=float(value)))

    def _job_done(self, job: Job, result: Any) -> None:
        self._mailbox.put(lambda: self._finish(job, result))

    def _finish(self, job: Job, result: Any) -> None:
        handed_out = self._handed_out.pop(id(job), None)
        if handed_out is not None:
            milliseconds = (time.perf_counter() - handed_out) * 1e3
            self.publish(Timing(f"{self.get_name()}/{job.method}_job", milliseconds))
        self.call(self.stage.finish, job, result)

    def _worker_warm(self) -> None:
        self._mailbox.put(lambda: self._set_worker(warm=True, failure=None))

    def _worker_failed(self, reason: str) -> None:
        self._mailbox.put(lambda: self._set_worker(warm=False, failure=reason))

    def _set_worker(self, warm: bool, failure: str | None) -> None:
        self.vital_signs.warm = warm
        self.vital_signs.worker_failure = failure
        if failure is not None:
            self.health.problem("worker_not_started", f"the worker does not start: {failure}")
            self._problems.report()

    def _submit(self, job: Job) -> None:
        if self._worker is None:
            raise RuntimeError(f"{type(self.stage).__name__} has jobs but no engine")
        self._handed_out[id(job)] = time.perf_counter()
        self._worker.submit(job)

    def _guarded(self, method: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return method(*arguments)
        except Exception as error:
            self.internal_error(error)
            return None
