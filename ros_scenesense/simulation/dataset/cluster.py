"""Runs independent jobs on a Dask cluster: a `dask scheduler`, and `dask worker`s on any machine.

Workers may come and go. What a worker had in hand when it died is done again by another, and
results come back in the order of the jobs, so nothing tells who did what. Dask comes with the
optional extra `cluster`.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from ros_scenesense.errors import DatasetError, SceneSenseError
from ros_scenesense.simulation.dataset.metadata import installed_versions

if TYPE_CHECKING:
    from distributed import Client, Future

Part = TypeVar("Part")
Made = TypeVar("Made")


def run_on_cluster(
    address: str,
    function: Callable[[Part], Made],
    parts: Iterable[Part],
    versions: Mapping[str, str],
    patience_s: float = 10.0,
) -> Iterator[Made]:
    """Calls a function on each part, on a cluster; few calls are under way at a time.

    Args:
        address: Of the scheduler, e.g. `tcp://host:8786`.
        function: What a worker does, picklable; a worker process never does two at once.
        parts: What to call it on.
        versions: Of the programs that decide about results, which every worker must have.
        patience_s: How long to wait for a scheduler or for workers.

    Yields:
        The results, in the order of the parts.

    Raises:
        DatasetError: If Dask is not installed, the cluster cannot be reached, has no workers or
            other versions, or a part kills one worker after the other.
        SceneSenseError: What the function raised.
    """
    with _connected(address, patience_s) as client:
        _wait_for_workers(client, patience_s)
        _check_versions(client, versions)
        waiting: deque[Future[Made]] = deque()
        remaining = iter(parts)
        while True:
            room = _PARTS_PER_WORKER * len(client.nthreads()) - len(waiting)
            for part in islice(remaining, max(room, 0 if waiting else 1)):
                waiting.append(
                    client.submit(_do, function, part, versions, pure=False, retries=_RETRIES)
                )
            if not waiting:
                return
            yield _result(client, waiting.popleft(), patience_s)


# One in work and one ready: no worker waits for this process, which holds few results.
_PARTS_PER_WORKER = 2
# A worker that is shut down in good order fails what it has; the scheduler counts deaths itself.
_RETRIES = 2
_ONE_AT_A_TIME = threading.Lock()
_SAME_VERSIONS = "install the same versions everywhere"
_RESUME = "the finished scenes are kept: run the same command again"


def _do(function: Callable[[Part], Made], part: Part, versions: Mapping[str, str]) -> Made:
    """The job of a worker, which may have come after the others were asked for their versions."""
    differences = _differences(installed_versions(), versions)
    if differences:
        raise DatasetError(f"a worker of the cluster has {differences}: {_SAME_VERSIONS}")
    # Bullet's client belongs to the process: a worker with several threads takes turns.
    with _ONE_AT_A_TIME:
        return function(part)


@contextmanager
def _connected(address: str, patience_s: float) -> Iterator[Client]:
    try:
        from distributed import Client
    except ImportError as error:
        raise DatasetError(
            f"a cluster needs Dask, which cannot be imported ({error}): "
            "pip install 'ros_scenesense[cluster]'"
        ) from error
    try:
        asyncio.run(asyncio.wait_for(_greet(address, patience_s), 2.0 * patience_s))
        client = Client(address, timeout=patience_s, set_as_default=False)
    except (OSError, TypeError, ValueError) as error:
        raise DatasetError(
            f"no scheduler answers at '{address}' ({str(error) or 'nothing comes back'}): start "
            "one with `dask scheduler`, which prints its address"
        ) from error
    with client:
        try:
            yield client
        except (OSError, CancelledError) as error:
            raise DatasetError(
                f"the scheduler at '{address}' was lost ({error}); {_RESUME}"
            ) from error


async def _greet(address: str, patience_s: float) -> None:
    """Tries the connection: where something listens that is no scheduler, the client hangs."""
    from distributed import Security
    from distributed.comm import connect

    comm = await connect(address, patience_s, **Security().get_connection_args("client"))
    await comm.close()


def _wait_for_workers(client: Client, patience_s: float) -> None:
    try:
        client.wait_for_workers(1, timeout=patience_s)
    except TimeoutError as error:
        address = client.scheduler.address
        raise DatasetError(
            f"the cluster at '{address}' has no workers: start them with "
            f"`dask worker {address} --nthreads 1`; {_RESUME}"
        ) from error


def _check_versions(client: Client, versions: Mapping[str, str]) -> None:
    for worker, found in client.run(installed_versions, on_error="return").items():
        if isinstance(found, Exception):
            raise DatasetError(f"worker {worker} cannot work ({found}): {_SAME_VERSIONS}")
        differences = _differences(found, versions)
        if differences:
            raise DatasetError(f"worker {worker} has {differences}: {_SAME_VERSIONS}")


def _differences(found: Mapping[str, str], asked: Mapping[str, str]) -> str:
    return ", ".join(
        f"{name} {found.get(name, 'missing')} instead of {version}"
        for name, version in asked.items()
        if found.get(name) != version
    )


def _result(client: Client, future: Future[Any], patience_s: float) -> Any:
    """What a job made, however long it takes as long as there are workers."""
    from distributed import KilledWorker

    while True:
        try:
            error = future.exception(timeout=patience_s)
            break
        except TimeoutError:
            _wait_for_workers(client, patience_s)
    if error is None:
        return future.result()
    if isinstance(error, SceneSenseError | CancelledError):
        raise error
    if isinstance(error, KilledWorker):
        raise DatasetError(
            f"{error.allowed_failures + 1} workers died one after the other of the same scenes, "
            "perhaps for want of memory: see their logs, and start them with more "
            f"(`dask worker --memory-limit`); {_RESUME}"
        ) from error
    raise DatasetError(
        f"a worker of the cluster failed ({type(error).__name__}: {error}): see its log; {_RESUME}"
    ) from error
