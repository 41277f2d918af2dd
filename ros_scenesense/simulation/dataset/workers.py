"""Does independent parts of a job in worker processes of this machine."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from typing import TypeVar

from ros_scenesense.errors import DatasetError

Part = TypeVar("Part")
Made = TypeVar("Made")


def run_by_workers(
    function: Callable[[Part], Made], parts: Iterable[Part], jobs: int
) -> Generator[Made, None, None]:
    """Calls a function on each part; few calls are under way at a time.

    Args:
        function: What a worker does, picklable.
        parts: What to call it on.
        jobs: Number of worker processes, which end with the last part.

    Yields:
        The results, in the order of the parts.

    Raises:
        DatasetError: If a worker dies.
        SceneSenseError: What the function raised.
    """
    from joblib import Parallel, delayed
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    parallel = Parallel(n_jobs=jobs, return_as="generator", pre_dispatch="2*n_jobs", batch_size=1)
    try:
        yield from parallel(delayed(function)(part) for part in parts)
    except BrokenProcessPool as error:
        raise DatasetError(
            "a worker process died, perhaps for want of memory; the finished scenes are kept: run "
            "the same command again, or with fewer --jobs"
        ) from error
    finally:
        get_reusable_executor().shutdown(wait=True, kill_workers=True)


def parts_of(indices: Sequence[int], size: int, jobs: int = 1) -> list[Sequence[int]]:
    """The indices in parts of at most this size, as many as there are jobs where they are few."""
    size = max(1, min(size, -(-len(indices) // jobs)))
    return [indices[first : first + size] for first in range(0, len(indices), size)]
