"""One job in a worker process of its own: what a command does that must not run for ever.

clingo cannot be interrupted while it grounds; a process can be killed.
"""

from __future__ import annotations

import queue
from collections.abc import Callable
from typing import Any

from ros_scenesense.errors import WorkerError
from ros_scenesense.stages.protocol import Job, JobFailure
from ros_scenesense.stages.worker import GIB, WorkerProcess


def run_once(
    factory: Callable[[], Any],
    method: str,
    arguments: tuple[Any, ...],
    deadline_s: float,
    memory_bytes: int = 4 * GIB,
) -> Any:
    """Runs a method of an engine in a process, and waits for its result.

    Args:
        factory: Picklable; builds the engine in the process.
        method: Name of its method.
        arguments: Picklable positional arguments.
        deadline_s: After this time the process is killed.
        memory_bytes: Address space that it may use.

    Returns:
        The result, or a `JobFailure` if the method raised or ran out of time or memory.

    Raises:
        WorkerError: If there is no answer at all.
    """
    results: queue.Queue[Any] = queue.Queue()
    worker = WorkerProcess(
        factory, lambda _job, result: results.put(result), memory_bytes=memory_bytes
    )
    try:
        worker.submit(Job("command", method, arguments, deadline_s))
        result = results.get(timeout=deadline_s + _STARTING_S)
    except queue.Empty as error:
        raise WorkerError(f"the worker process did not answer within {deadline_s:g} s") from error
    finally:
        worker.close()
    if isinstance(result, JobFailure):
        return JobFailure(result.reason.removeprefix(f"{method} of command: "), result.timed_out)
    return result


# A process is given a minute to start.
_STARTING_S = 65.0
