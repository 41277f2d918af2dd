"""Starts the nodes of the graph, one process each, watches them and stops them.

The launcher is a ROS node itself, in the domain of the graph: it knows by their heartbeats which
nodes are ready and alive. (A killed node stays visible in the ROS graph for seconds.)
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

import platformdirs
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from ros_scenesense.errors import LaunchError, MessageError, ParameterError
from ros_scenesense.launcher.options import GraphOptions
from ros_scenesense.launcher.parameter_values import parameter_values, write_parameter_values
from ros_scenesense.launcher.process import RESTART_LIMIT, RESTART_WINDOW_S, NodeProcess, stop_all
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.registry import LAUNCHER_VARIABLE

START_S = 60.0
"""A node that is not ready after so long is restarted."""
KEPT_LOGS = 10
_DEAF_S = 1.0
_STRANGERS = 20


class Graph:
    """The running node graph; a context manager that starts and stops it.

    The caller may make nodes of its own with `context`, add them to `executor`, and so take part
    in the graph; their callbacks run inside `poll`, `wait_ready` and `spin_until`.

    Args:
        options: What to start and how.
        report: Takes one-line events for people.

    Attributes:
        options: As given.
        nodes: The processes by name.
        context: ROS context in the domain of the graph; from `start` to `stop`.
        executor: Runs this process's callbacks; from `start` to `stop`.
        log_dir: Where the logs are.
        ready_s: Seconds from `start` until all nodes were ready; None before.

    Raises:
        ParameterError: If an option, a parameter's name or its value is wrong.
    """

    context: Context
    executor: SingleThreadedExecutor

    def __init__(
        self, options: GraphOptions, report: Callable[[str], None] = lambda _line: None
    ) -> None:
        self.options = options
        self.nodes: dict[str, NodeProcess] = {}
        self.ready_s: float | None = None
        self.log_dir = options.log_dir or _own_log_dir()
        self._report = report
        self._values = parameter_values(options)
        self._node: Node | None = None
        self._started = 0.0
        self._polled = 0.0
        self._known: set[tuple[str, int | None]] = set()
        self._strangers: set[tuple[str, int | None]] = set()

    def __enter__(self) -> Graph:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def start(self) -> None:
        """Starts all nodes; does not wait for them.

        Sets the ROS variables of this process that the user has not set: it joins the graph.

        Raises:
            LaunchError: If the log folder cannot be written.
        """
        self._started = self._polled = time.monotonic()
        os.environ.update(self.options.environment())
        try:
            self._start_processes()
            self._join_graph()
        except BaseException as error:
            self.stop()
            if isinstance(error, OSError):
                raise LaunchError(f"the nodes cannot be started: {error}") from error
            raise

    def poll(self, timeout_s: float = 0.1) -> None:
        """Waits for an event up to a time, handles it, and looks after the processes.

        Raises:
            ParameterError: If a node ended because of a wrong parameter.
            LaunchError: If a node cannot start, or died too often.
        """
        self.executor.spin_once(timeout_sec=timeout_s)
        now = time.monotonic()
        deaf_s, self._polled = now - self._polled - timeout_s, now
        for process in self.nodes.values():
            # Nobody is silent while we do not listen: our caller, or a callback of its, was busy.
            if deaf_s > _DEAF_S:
                process.excuse(deaf_s)
            self._supervise(process)

    def spin_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Polls until a condition holds; returns whether it did in time."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > deadline:
                return False
            self.poll(0.1)
        return True

    def wait_ready(self, timeout_s: float = START_S) -> None:
        """Polls until all nodes are ready.

        Raises:
            LaunchError: If they are not in time; as `poll` besides.
        """
        if not self.spin_until(lambda: self.ready_s is not None, timeout_s):
            missing = [process for process in self.nodes.values() if not process.ready]
            names = ", ".join(process.name for process in missing)
            raise LaunchError(f"not ready after {timeout_s:g} s: {names}{_log_of(missing[0])}")

    def stop(self) -> None:
        """Stops all nodes and leaves the graph. May be called again."""
        stop_all(self.nodes.values())
        if self._node is not None:
            self.executor.shutdown()
            self._node.destroy_node()
            self.context.try_shutdown()
            self._node = None

    def _start_processes(self) -> None:
        self.log_dir.mkdir(parents=True, exist_ok=True)
        if self.options.log_dir is None:
            _remove_old_logs(self.log_dir.parent)
        file = self.log_dir / "params.yaml"
        write_parameter_values(file, self.options, self._values)
        arguments = ["--ros-args", "-r", f"__ns:={self.options.namespace}"]
        arguments += [word for remap in self.options.remaps for word in ("-r", remap)]
        arguments += ["--params-file", str(file), "--disable-external-lib-logs"]
        environment = {
            **os.environ,
            LAUNCHER_VARIABLE: str(os.getpid()),
            "RCUTILS_COLORIZED_OUTPUT": "0",
        }
        for name in self.options.nodes:
            log_path = self.log_dir / f"{name}.log"
            self.nodes[name] = NodeProcess(name, arguments, environment, log_path)
            self._start(self.nodes[name])

    def _start(self, process: NodeProcess) -> None:
        process.start()
        # A heartbeat of a killed process may still be on its way when the next one runs.
        self._known.add((process.name, process.pid))

    def _join_graph(self) -> None:
        self.context = Context()
        self.context.init(args=[], domain_id=self.options.domain_id)
        self.executor = SingleThreadedExecutor(context=self.context)
        self._node = Node(
            "launcher",
            namespace=self.options.namespace,
            context=self.context,
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        topic = TOPICS[Heartbeat]
        self._node.create_subscription(String, topic.name, self._hear, profile_of(topic.qos))
        self._node.create_subscription(Log, "/rosout", self._pass_on, QoSProfile(depth=100))
        self.executor.add_node(self._node)

    def _hear(self, message: String) -> None:
        try:
            heartbeat = decode(message.data, Heartbeat)
        except MessageError:
            return
        process = self.nodes.get(heartbeat.node)
        if process is None or process.pid != heartbeat.process_id:
            self._hear_stranger(heartbeat)
            return
        if process.heard(heartbeat):
            again = f" (restart {process.restarts})" if process.restarts else ""
            self._report(f"{process.name} is ready after {self._elapsed_s():.1f} s{again}")
        if self.ready_s is None and all(other.ready for other in self.nodes.values()):
            self.ready_s = self._elapsed_s()
            self._report(f"all nodes are ready after {self.ready_s:.1f} s")

    def _hear_stranger(self, heartbeat: Heartbeat) -> None:
        """Warns of a second node of a name in the same graph: their scenes would mix."""
        stranger = (heartbeat.node, heartbeat.process_id)
        known = stranger in self._known or stranger in self._strangers
        # Whoever sends ever other process ids shall fill neither memory nor terminal.
        if heartbeat.node in self.nodes and not known and len(self._strangers) < _STRANGERS:
            self._strangers.add(stranger)
            self._report(
                f"a node '{heartbeat.node}' of somebody else (process {heartbeat.process_id}) runs "
                f"in {self.options.namespace} too: choose another --domain-id or --namespace"
            )

    def _pass_on(self, message: Log) -> None:
        name = message.name.rpartition(".")[2]
        if message.level >= _level(Log.WARN) and name in self.nodes:
            self._report(f"{name}: {message.msg.splitlines()[0] if message.msg else ''}")

    def _supervise(self, process: NodeProcess) -> None:
        code = process.exit_code
        if process.restart_at is not None:
            if time.monotonic() >= process.restart_at:
                self._start(process)
        elif code is not None:
            self._restart_or_give_up(process, code)
        elif process.silent_s > (self.options.silence_s if process.ready else START_S):
            self._report(
                f"{process.name} gave no sign of life for {process.silent_s:.0f} s: killed"
            )
            process.kill()

    def _restart_or_give_up(self, process: NodeProcess, code: int) -> None:
        process.kill()  # what it may have left behind
        lines = process.last_lines()
        if code == 2 and process.heartbeat is None:
            raise ParameterError(lines[-1] if lines else f"{process.name} refused its parameters")
        cause = f"killed by signal {-code}" if code < 0 else f"exit code {code}"
        if code > 0 and process.ready_s is None:
            raise LaunchError(f"{process.name} cannot start ({cause}){_log_of(process)}")
        delay_s = process.plan_restart()
        if delay_s is None:
            raise LaunchError(
                f"{process.name} died more than {RESTART_LIMIT} times in {RESTART_WINDOW_S:.0f} s, "
                f"the last time: {cause}{_log_of(process)}"
            )
        self._report(f"{process.name} died ({cause}), starts again in {delay_s:g} s")

    def _elapsed_s(self) -> float:
        return time.monotonic() - self._started


def _log_of(process: NodeProcess) -> str:
    lines = process.last_lines()
    return f"; the end of {process.log_path}:\n" + "\n".join(f"  {line}" for line in lines)


def _level(value: int | bytes) -> int:
    # The constants of rcl_interfaces/Log are bytes in Python, its field is an integer.
    return value if isinstance(value, int) else int.from_bytes(value, "little")


def _own_log_dir() -> Path:
    """A folder that no other launcher uses."""
    name = f"launch-{time.strftime('%Y%m%dT%H%M%S')}-{os.getpid()}"
    return platformdirs.user_log_path("scenesense", appauthor=False) / name


def _remove_old_logs(parent: Path) -> None:
    old = sorted(path for path in parent.glob("launch-*") if path.is_dir())
    for path in old[:-KEPT_LOGS]:
        shutil.rmtree(path, ignore_errors=True)
