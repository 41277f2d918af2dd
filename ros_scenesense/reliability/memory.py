"""Memory of processes, as Linux counts it, and how much it grew over a run."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import quantiles

WARM_UP = 1 / 6
"""Share of a run until caches and histories are full."""
_WINDOW = 0.1
_MIB = 1024**2


@dataclass(frozen=True)
class Sample:
    """Resident memory in MiB by node, so many seconds after the start."""

    elapsed_s: float
    mib: dict[str, float]


@dataclass(frozen=True)
class Growth:
    """Memory of a node after the warm-up and at the end, MiB.

    Lower quartiles of a tenth of the run each: what a node holds when it is not just learning.
    """

    warm_mib: float
    end_mib: float

    @property
    def percent(self) -> float:
        """What the end is above the beginning."""
        return 100.0 * (self.end_mib / self.warm_mib - 1.0)


def tree_mib(pid: int) -> float:
    """Resident memory of a process and of all that it started, MiB; what is gone counts nothing."""
    return sum(map(_resident_bytes, family(pid))) / _MIB


def family(pid: int) -> Iterator[int]:
    """A process and all that it started."""
    yield pid
    for file in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            children = file.read_text().split()
        except OSError:  # it has just ended
            continue
        for child in children:
            yield from family(int(child))


def growth(samples: Sequence[Sample]) -> dict[str, Growth]:
    """How the memory of each node grew after the warm-up.

    Raises:
        ValueError: If there are fewer than ten samples.
    """
    if len(samples) < 10:
        raise ValueError(f"{len(samples)} samples are too few to tell growth")
    first = round(WARM_UP * len(samples))
    window = max(1, round(_WINDOW * len(samples)))
    early, late = samples[first : first + window], samples[-window:]
    return {name: Growth(_quartile(early, name), _quartile(late, name)) for name in samples[-1].mib}


def _quartile(samples: Sequence[Sample], name: str) -> float:
    values = [sample.mib[name] for sample in samples if name in sample.mib]
    return quantiles(values, n=4)[0] if len(values) > 1 else values[0]


def _resident_bytes(pid: int) -> int:
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except OSError:
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")
