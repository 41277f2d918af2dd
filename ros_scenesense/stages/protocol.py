"""What a stage is: the one place where a step of the loop is put together.

A stage takes messages and frames and gives messages and frames. Slow work it hands out as jobs
for its *engine*, an object that the caller builds from `engine()`: a node in a worker process,
the pipeline in its own. So what an experiment measures is what runs on the graph.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.scene import Frame
from ros_scenesense.stages.health import Health


@dataclass(frozen=True, eq=False)
class Segmentation:
    """Instance ids of a frame, (H, W) uint16, 0 = background, as grounding used them."""

    stamp_ns: int
    frame_id: str
    instances: npt.NDArray[np.uint16]


@dataclass(frozen=True, eq=False)
class Cloud:
    """Coloured points of a frame: (N, 3) float32 metres in the optical frame, (N, 3) uint8 RGB."""

    stamp_ns: int
    frame_id: str
    points: npt.NDArray[np.float32]
    colors: npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Timing:
    """How long a step took, published as `timing/<name>`."""

    name: str
    milliseconds: float


@dataclass(frozen=True)
class Figure:
    """A number for people to plot, published as `figures/<name>`; the last one is kept."""

    name: str
    value: float


Incoming = AnyMessage | Frame | Segmentation
Outgoing = AnyMessage | Frame | Segmentation | Cloud | Timing | Figure


@dataclass(frozen=True)
class Job:
    """Work for the stage's engine.

    Attributes:
        key: What the work is about, usually a scene id.
        method: Name of the engine's method.
        arguments: Picklable positional arguments.
        deadline_s: After this time the worker is killed and the job fails.
        droppable: Whether it may be dropped where too many newer ones of that kind wait.
    """

    key: str
    method: str
    arguments: tuple[Any, ...]
    deadline_s: float = 30.0
    droppable: bool = False


@dataclass(frozen=True)
class JobFailure:
    """Why a job has no result: it failed, ran out of time, was dropped, or its process died."""

    reason: str
    timed_out: bool = False
    dropped: bool = False


class Stage(Protocol):
    """A step of the loop. All methods are called from one thread."""

    health: Health

    def engine(self) -> Callable[[], Any] | None:
        """A picklable factory of the engine that runs the jobs; None if there are none."""

    def start(self, now_ns: int) -> list[Outgoing]:
        """Called once when the stage is connected, e.g. to publish its latched state."""

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes one message or frame. Never raises for what a message says."""

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Called regularly (at 20 Hz by nodes): time-outs, pacing, re-sending."""

    def jobs(self) -> list[Job]:
        """Jobs to run now, in order; asked for after every other call."""

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """Takes a job's result, or a `JobFailure`."""

    def close(self) -> None:
        """Lets go of files."""
