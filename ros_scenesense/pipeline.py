"""Chains the stages of the graph in one process, without ROS: for experiments and tests.

The stages are the ones that the nodes run, so what an experiment measures is what runs on the
graph. Jobs run inline; everything a stage publishes reaches every other stage.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.scene import Frame
from ros_scenesense.stages.protocol import Incoming, Job, Outgoing, Segmentation, Stage
from ros_scenesense.stages.worker import InlineRunner


class Pipeline:
    """Runs stages until nothing is left to do.

    Args:
        stages: In the order of the graph.
        clock: Gives the time in nanoseconds.
    """

    def __init__(self, stages: Sequence[Stage], clock: Callable[[], int] = time.time_ns) -> None:
        self.stages = list(stages)
        self._clock = clock
        self._published: deque[tuple[Stage | None, Outgoing]] = deque()
        self._runners = {id(stage): self._runner(stage) for stage in self.stages}
        for stage in self.stages:
            self._publish(stage, stage.start(clock()))

    def put(self, item: Incoming) -> None:
        """Gives a message or frame from outside to all stages."""
        self._published.append((None, item))

    def run(self) -> Iterator[Outgoing]:
        """Works until no message and no job is left; yields all that the stages publish.

        With a camera that shows scenes without end this goes on until the caller stops.
        """
        while True:
            while self._published:
                origin, item = self._published.popleft()
                if origin is not None:
                    yield item
                if isinstance(item, AnyMessage | Frame | Segmentation):
                    for stage in self.stages:
                        if stage is not origin:
                            self._publish(stage, stage.handle(item, self._clock()))
            worked = False
            for stage in self.stages:
                self._publish(stage, stage.tick(self._clock()))
                worked |= self._run_jobs(stage)
            if not worked and not self._published:
                return

    def close(self) -> None:
        """Closes engines and stages."""
        for stage in self.stages:
            runner = self._runners[id(stage)]
            if runner is not None:
                runner.close()
            stage.close()

    def _runner(self, stage: Stage) -> InlineRunner | None:
        factory = stage.engine()
        if factory is None:
            return None

        def done(job: Job, result: Any) -> None:
            self._publish(stage, stage.finish(job, result, self._clock()))

        return InlineRunner(factory, done)

    def _run_jobs(self, stage: Stage) -> bool:
        runner = self._runners[id(stage)]
        jobs = stage.jobs()
        for job in jobs:
            if runner is None:
                raise RuntimeError(f"{type(stage).__name__} has jobs but no engine")
            runner.submit(job)
        return bool(jobs)

    def _publish(self, stage: Stage, outgoing: list[Outgoing]) -> None:
        self._published.extend((stage, item) for item in outgoing)
