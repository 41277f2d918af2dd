"""Runs a stage's jobs: in a worker process with deadlines, or inline.

The worker is a fresh Python process (never a fork: the parent holds DDS threads). A job that
runs past its deadline kills the process; the next job gets a new one.
"""

from __future__ import annotations

import multiprocessing
import resource as limits
import signal
import threading
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, Protocol

from ros_scenesense.errors import SceneSenseError
from ros_scenesense.stages.protocol import Job, JobFailure

GIB = 1024**3


class JobRunner(Protocol):
    """Takes jobs and calls back with each result, in order."""

    def submit(self, job: Job) -> None:
        """Queues a job."""

    def close(self) -> None:
        """Stops; jobs that are not finished are dropped."""


Callback = Callable[[Job, Any], None]


class InlineRunner:
    """Runs each job at once, in this process; the engine is built by the first."""

    def __init__(self, factory: Callable[[], Any], done: Callback) -> None:
        self._factory = factory
        self._done = done
        self._engine: Any = None

    def submit(self, job: Job) -> None:
        """Runs the job and calls back."""
        if self._engine is None:
            self._engine = self._factory()
        self._done(job, _run(self._engine, job))

    def close(self) -> None:
        """Closes the engine."""
        if self._engine is not None:
            _close(self._engine)


class WorkerProcess:
    """Runs jobs in a process of their own, one after the other.

    Args:
        factory: Picklable; builds the engine in the process.
        done: Called from this object's thread with each job and its result or `JobFailure`.
        warm: Called (same thread) whenever an engine is built and waiting for jobs.
        memory_bytes: Address-space limit of the process; 0 = none.
        start_deadline_s: Time to build the engine.
    """

    def __init__(
        self,
        factory: Callable[[], Any],
        done: Callback,
        warm: Callable[[], None] = lambda: None,
        memory_bytes: int = 12 * GIB,
        start_deadline_s: float = 60.0,
    ) -> None:
        self._factory = factory
        self._done = done
        self._warm = warm
        self._memory_bytes = memory_bytes
        self._start_deadline_s = start_deadline_s
        self._context = multiprocessing.get_context("spawn")
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        self._queue: deque[Job] = deque()
        self._changed = threading.Condition()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="worker", daemon=True)
        self._thread.start()

    def submit(self, job: Job) -> None:
        """Queues a job."""
        with self._changed:
            self._queue.append(job)
            self._changed.notify()

    def close(self) -> None:
        """Kills the process and drops what is queued."""
        with self._changed:
            self._closing.set()
            self._changed.notify()
        self._kill()
        self._thread.join(timeout=10.0)

    def _serve(self) -> None:
        while not self._closing.is_set():
            failure = self._ensure_process()
            with self._changed:
                self._changed.wait_for(lambda: self._queue or self._closing.is_set())
                if self._closing.is_set():
                    return
                job = self._queue.popleft()
            result = failure or self._execute(job)
            if not self._closing.is_set():
                self._done(job, result)

    def _ensure_process(self) -> JobFailure | None:
        if self._process is not None and self._process.is_alive():
            return None
        self._pipe, theirs = self._context.Pipe()
        self._process = self._context.Process(
            target=_worker_main, args=(self._factory, theirs, self._memory_bytes), daemon=True
        )
        self._process.start()
        theirs.close()
        answer = self._receive(self._start_deadline_s, "the engine did not start")
        if answer is None:
            self._warm()
        return answer if isinstance(answer, JobFailure) else None

    def _execute(self, job: Job) -> Any:
        assert self._pipe is not None
        try:
            self._pipe.send(job)
        except (OSError, ValueError) as error:
            self._kill()
            return JobFailure(f"the worker process is gone: {error}")
        return self._receive(job.deadline_s, f"{job.method} of {job.key}")

    def _receive(self, deadline_s: float, what: str) -> Any:
        assert self._pipe is not None
        try:
            if self._pipe.poll(deadline_s):
                return self._pipe.recv()
        except (EOFError, OSError):
            self._kill()
            return JobFailure(f"{what}: the worker process died")
        self._kill()
        return JobFailure(f"{what}: stopped after {deadline_s:g} s", timed_out=True)

    def _kill(self) -> None:
        process = self._process
        if process is not None and process.pid is not None:
            process.kill()
            process.join(timeout=5.0)


def _worker_main(factory: Callable[[], Any], pipe: Connection, memory_bytes: int) -> None:
    # Ctrl-C in a terminal reaches the whole process group; the parent decides when to stop.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if memory_bytes:
        limits.setrlimit(limits.RLIMIT_AS, (memory_bytes, memory_bytes))
    try:
        engine = factory()
    except Exception as error:
        pipe.send(JobFailure(f"the engine did not start: {_words(error)}"))
        return
    pipe.send(None)
    while True:
        try:
            job = pipe.recv()
        except (EOFError, KeyboardInterrupt):
            _close(engine)
            return
        pipe.send(_run(engine, job))


def _run(engine: Any, job: Job) -> Any:
    try:
        return getattr(engine, job.method)(*job.arguments)
    except Exception as error:
        # Whatever goes wrong in one job must not take the stage down; the words reach the log.
        return JobFailure(_words(error))


def _close(engine: Any) -> None:
    if hasattr(engine, "close"):
        engine.close()


def _words(error: Exception) -> str:
    if isinstance(error, SceneSenseError):
        return str(error)
    return f"{type(error).__name__}: {error}"
