"""Runs a stage's jobs: in a worker process with deadlines, or inline.

The worker is a fresh Python process (never a fork: the parent holds DDS threads). A job that
runs past its deadline kills the process; the next job gets a new one.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
import pickle
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
CAPACITY = 32
"""So many droppable jobs wait at most; a camera has no more scenes in flight."""


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
        failure = None
        if self._engine is None:
            self._engine, failure = _build(self._factory)
        self._done(job, failure or _run(self._engine, job))

    def close(self) -> None:
        """Closes the engine, if it has a `close`."""
        if hasattr(self._engine, "close"):
            self._engine.close()


class WorkerProcess:
    """Runs jobs in a process of their own, one after the other.

    The process is started before the first job comes, so that it finds a warm engine, and again
    whenever a job brought it down. If the engine cannot be built, each job makes one new attempt.
    Of the jobs that may be dropped at most `CAPACITY` wait: for a newer one the oldest is given up,
    with a `JobFailure`.
    The process dies with this one, at once and without a call of the engine's `close`.
    An engine may say by an attribute `jobs_per_life` after how many jobs it wants a new process,
    e.g. because a library that it calls loses memory.

    Args:
        factory: Picklable; builds the engine in the process.
        done: Called from this object's thread with each job and its result or `JobFailure`, from
            the submitting one where the job is dropped; must not raise.
        warm: Called (same thread) whenever an engine is built and waiting for jobs.
        failed: Called (same thread) with the reason whenever an engine could not be built.
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
        failed: Callable[[str], None] = lambda _reason: None,
    ) -> None:
        self._factory = factory
        self._done = done
        self._warm = warm
        self._failed = failed
        self._memory_bytes = memory_bytes
        self._start_deadline_s = start_deadline_s
        self._context = multiprocessing.get_context("spawn")
        # Only the thread below starts, talks to and reaps processes. Other threads may kill the
        # current one, under the lock: whatever the thread waits for then ends with an EOF.
        self._changed = threading.Condition()
        self._queue: deque[Job] = deque()
        self._closing = False
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        self._jobs_left: int | None = None
        self._thread = threading.Thread(target=self._serve, name="worker", daemon=True)
        self._thread.start()

    def submit(self, job: Job) -> None:
        """Queues a job; drops the oldest droppable one if there are too many."""
        with self._changed:
            self._queue.append(job)
            waiting = [each for each in self._queue if each.droppable]
            dropped = waiting[0] if len(waiting) > CAPACITY else None
            if dropped is not None:
                self._queue.remove(dropped)
            self._changed.notify()
        if dropped is not None:
            words = f"{dropped.method} of {dropped.key}: dropped, {CAPACITY} newer jobs wait"
            self._done(dropped, JobFailure(words, dropped=True))

    def close(self) -> None:
        """Kills the process and drops what is queued."""
        with self._changed:
            self._closing = True
            self._changed.notify()
            self._kill()
        self._thread.join(timeout=10.0)

    def _serve(self) -> None:
        try:
            self._ensure_process()
            while (job := self._next_job()) is not None:
                # While it waited for the job the process may have died.
                failure = self._ensure_process()
                result = failure or self._execute(job)
                if self._closing:
                    return
                self._done(job, result)
                if failure is None:
                    self._renew_if_worn()
                    self._ensure_process()
        finally:
            self._discard()

    def _next_job(self) -> Job | None:
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closing)
            return None if self._closing else self._queue.popleft()

    def _renew_if_worn(self) -> None:
        if self._jobs_left is not None:
            self._jobs_left -= 1
            if self._jobs_left <= 0:
                self._discard()

    def _ensure_process(self) -> JobFailure | None:
        with self._changed:
            if self._process is not None and self._process.is_alive():
                return None
        self._discard()
        failure = self._start_process()
        if failure is None:
            self._warm()
        elif not self._closing:
            self._failed(failure.reason)
        return failure

    def _start_process(self) -> JobFailure | None:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(
            target=_worker_main, args=(self._factory, theirs, self._memory_bytes), daemon=True
        )
        try:
            process.start()
        except Exception as error:
            # A factory that cannot be pickled, or no memory for one more process.
            ours.close()
            return JobFailure(f"the worker process did not start: {_words(error)}")
        finally:
            theirs.close()
        with self._changed:
            self._process, self._pipe = process, ours
            if self._closing:
                self._kill()
        started = self._exchange(None, self._start_deadline_s, "the engine did not start")
        if isinstance(started, JobFailure):
            self._discard()
            return started
        self._jobs_left = started
        return None

    def _execute(self, job: Job) -> Any:
        try:
            payload = pickle.dumps(job)
        except Exception as error:
            return JobFailure(f"{job.method} of {job.key} cannot be sent: {_words(error)}")
        return self._exchange(payload, job.deadline_s, f"{job.method} of {job.key}")

    def _exchange(self, payload: bytes | None, deadline_s: float, what: str) -> Any:
        """Sends a payload and waits for the answer, both until the deadline."""
        assert self._pipe is not None
        overran = threading.Event()

        def stop() -> None:
            overran.set()
            with self._changed:
                self._kill()

        # Killing is what ends a send or a receive that hangs half-way, too.
        timer = threading.Timer(deadline_s, stop)
        timer.daemon = True
        timer.start()
        answer = None
        try:
            if payload is not None:
                self._pipe.send_bytes(payload)
            answer = self._pipe.recv_bytes()
        except (EOFError, OSError):
            pass
        finally:
            timer.cancel()
            timer.join()
        if answer is None or overran.is_set():
            self._discard()
        if overran.is_set():
            return JobFailure(f"{what}: stopped after {deadline_s:g} s", timed_out=True)
        if answer is None:
            return JobFailure(f"{what}: the worker process died")
        return _unpack(answer, what)

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()

    def _discard(self) -> None:
        with self._changed:
            self._kill()
            if self._process is not None:
                self._process.join(timeout=5.0)
            if self._pipe is not None:
                self._pipe.close()
            self._process = self._pipe = None


def _worker_main(factory: Callable[[], Any], pipe: Connection, memory_bytes: int) -> None:
    # Ctrl-C in a terminal reaches the whole process group; the parent decides when to stop.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_die_with_parent, daemon=True).start()
    if memory_bytes:
        _, hard = limits.getrlimit(limits.RLIMIT_AS)
        soft = memory_bytes if hard == limits.RLIM_INFINITY else min(memory_bytes, hard)
        limits.setrlimit(limits.RLIMIT_AS, (soft, hard))
    engine, failure = _build(factory)
    # What is there now stays: collecting garbage among it would only pause the jobs.
    gc.collect()
    gc.freeze()
    # The pipe breaks when the parent is gone.
    with contextlib.suppress(EOFError, OSError):
        pipe.send_bytes(pickle.dumps(failure or getattr(engine, "jobs_per_life", None)))
        while failure is None:
            pipe.send_bytes(_answer(engine, pipe.recv_bytes()))


def _die_with_parent() -> None:
    # Also in the middle of a job: nobody is left to take its result or to stop it.
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _answer(engine: Any, payload: bytes) -> bytes:
    try:
        return pickle.dumps(_run(engine, pickle.loads(payload)))
    except Exception as error:
        return pickle.dumps(JobFailure(f"job or result cannot be sent: {_words(error)}"))


def _unpack(answer: bytes, what: str) -> Any:
    try:
        return pickle.loads(answer)
    except Exception as error:
        return JobFailure(f"{what}: the result cannot be read: {_words(error)}")


def _build(factory: Callable[[], Any]) -> tuple[Any, JobFailure | None]:
    try:
        return factory(), None
    except Exception as error:
        return None, JobFailure(f"the engine did not start: {_words(error)}")


def _run(engine: Any, job: Job) -> Any:
    try:
        return getattr(engine, job.method)(*job.arguments)
    except Exception as error:
        # Whatever goes wrong in one job must not take the stage down; the words reach the log.
        return JobFailure(_words(error))


def _words(error: Exception) -> str:
    if isinstance(error, SceneSenseError):
        return str(error)
    return f"{type(error).__name__}: {error}".removesuffix(": ")
