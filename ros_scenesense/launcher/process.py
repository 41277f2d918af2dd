"""One node process: starting it, its log, the policy of restarts, and stopping it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterable, Mapping
from pathlib import Path

from ros_scenesense.messages.health import Heartbeat

RESTART_LIMIT = 5
RESTART_WINDOW_S = 60.0
FIRST_DELAY_S = 0.1
LOG_LINES = 15
STOP_STEPS = ((signal.SIGINT, 5.0), (signal.SIGTERM, 3.0), (signal.SIGKILL, 5.0))


class NodeProcess:
    """A node's process and what is known of it.

    Args:
        name: Name of the node.
        arguments: ROS arguments.
        environment: Environment of the process.
        log_path: Its output is appended to this file.

    Attributes:
        heartbeat: The last one of the running process; None before the first.
        ready_s: Seconds from the first start until the node was ready; None before.
        restarts: How often it was started again.
    """

    def __init__(
        self, name: str, arguments: list[str], environment: Mapping[str, str], log_path: Path
    ) -> None:
        self.name = name
        self.log_path = log_path
        self.heartbeat: Heartbeat | None = None
        self.ready_s: float | None = None
        self.restarts = -1
        self.restart_at: float | None = None
        self._command = [sys.executable, "-m", "ros_scenesense.nodes", name, *arguments]
        self._environment = dict(environment)
        self._deaths: deque[float] = deque()
        self._process: subprocess.Popen[bytes] | None = None
        self._first_started = 0.0
        self._heard = 0.0

    @property
    def pid(self) -> int | None:
        """Process id; None before the start."""
        return None if self._process is None else self._process.pid

    @property
    def exit_code(self) -> int | None:
        """Exit code, negative for a signal; None while the process runs or before the start."""
        return None if self._process is None else self._process.poll()

    @property
    def ready(self) -> bool:
        """Whether the running process said that it is ready."""
        return self.heartbeat is not None and self.heartbeat.ready and self.exit_code is None

    @property
    def silent_s(self) -> float:
        """Seconds since the last heartbeat, or since the start."""
        return time.monotonic() - self._heard

    def start(self) -> None:
        """Starts the process, in a session of its own: Ctrl-C reaches it through `stop` only."""
        self.restart_at = None
        self.heartbeat = None
        self.restarts += 1
        with self.log_path.open("ab") as log:
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=self._environment,
                start_new_session=True,
            )
        self._heard = time.monotonic()
        if self.restarts == 0:
            self._first_started = self._heard

    def heard(self, heartbeat: Heartbeat) -> bool:
        """Takes a heartbeat of this process; returns whether it just became ready."""
        was_ready = self.ready
        self._heard = time.monotonic()
        self.heartbeat = heartbeat
        if self.ready and self.ready_s is None:
            self.ready_s = self._heard - self._first_started
        return self.ready and not was_ready

    def excuse(self, seconds: float) -> None:
        """Time in which nobody listened is no silence."""
        self._heard = min(self._heard + seconds, time.monotonic())

    def plan_restart(self) -> float | None:
        """Notes a death; the delay of the restart in seconds, None if there were too many."""
        now = time.monotonic()
        self._deaths.append(now)
        while now - self._deaths[0] > RESTART_WINDOW_S:
            self._deaths.popleft()
        if len(self._deaths) > RESTART_LIMIT:
            return None
        delay_s: float = FIRST_DELAY_S * 2 ** (len(self._deaths) - 1)
        self.restart_at = now + delay_s
        return delay_s

    def kill(self) -> None:
        """Kills the process and all that it started."""
        self.send_signal(signal.SIGKILL)

    def last_lines(self) -> list[str]:
        """The last lines of the log."""
        with contextlib.suppress(OSError), self.log_path.open("rb") as log:
            log.seek(0, os.SEEK_END)
            log.seek(max(0, log.tell() - 16_384))
            return log.read().decode(errors="replace").splitlines()[-LOG_LINES:]
        return []

    def send_signal(self, number: signal.Signals) -> None:
        """Signals the process; SIGKILL also goes to all that it started."""
        if self._process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            if number is signal.SIGKILL:
                os.killpg(self._process.pid, number)
            else:
                self._process.send_signal(number)

    def wait(self, seconds: float) -> None:
        """Waits for the end of the process, up to a time."""
        if self._process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(timeout=max(0.0, seconds))


def stop_all(processes: Iterable[NodeProcess]) -> None:
    """Stops processes: SIGINT, after 5 s SIGTERM, after 3 s more SIGKILL."""
    running = [process for process in processes if process.pid is not None]
    for number, patience_s in STOP_STEPS:
        running = [process for process in running if process.exit_code is None]
        for process in running:
            process.send_signal(number)
        deadline = time.monotonic() + patience_s
        for process in running:
            process.wait(deadline - time.monotonic())
