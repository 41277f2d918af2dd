"""The node `recorder`: writes all topics of the graph into bags, which any ROS 2 tool reads."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from std_srvs.srv import Trigger

from ros_scenesense.bags.recording import Recording, RecordingLimits
from ros_scenesense.bags.writing import BagFormat
from ros_scenesense.nodes.base import TICK_S, StageNode
from ros_scenesense.nodes.running import run
from ros_scenesense.nodes.topic_watch import TopicChoice, TopicWatch, patterns_of
from ros_scenesense.stages.recorder import MB, RecorderConfiguration, RecorderStage

_LOOK_TICKS = round(0.3 / TICK_S)


class RecorderNode(StageNode):
    """Gives `RecorderStage` the topics of the graph and two services."""

    stage: RecorderStage
    configuration: RecorderConfiguration

    def __init__(self, **node_options: Any) -> None:
        super().__init__(
            "recorder",
            RecorderConfiguration,
            lambda configuration: RecorderStage(configuration, _recording, self._say),
            **node_options,
        )

    def connect(self) -> None:
        """Subscribes to the topics; adds the services."""
        super().connect()
        configuration = self.configuration
        choice = TopicChoice(
            self.get_namespace(),
            patterns_of(configuration.topics),
            patterns_of(configuration.leave_out),
        )
        self._ticks = 0
        self._watch = TopicWatch(self, self.health, choice, self.stage.add_topic, self.stage.record)
        self._serve("recorder/start", self.stage.begin)
        self._serve("recorder/stop", self.stage.end)

    def tick(self) -> None:
        """Looks for new topics."""
        if self._ticks % _LOOK_TICKS == 0:
            self._guarded(self._watch.look)
        self._ticks += 1
        super().tick()

    def _serve(self, name: str, method: Callable[[], tuple[bool, str]]) -> None:
        def serve(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            answer = self._guarded(method)
            response.success, response.message = answer or (False, "failed: see the node's log")
            return response

        self.create_service(Trigger, name, serve)

    def _say(self, words: str) -> None:
        if self.context.ok():
            self.get_logger().info(words)
        else:  # asked to stop: nobody can be told but the reader of the log
            print(words, flush=True)


def _recording(configuration: RecorderConfiguration, folder: Path) -> Recording:
    format = BagFormat(
        "sqlite3" if configuration.storage == "sqlite3" else "mcap",
        compressed=configuration.compression == "zstd",
        file_bytes=configuration.file_mb * MB,
    )
    limits = RecordingLimits(
        queue_bytes=configuration.queue_mb * MB,
        bag_bytes=configuration.bag_mb * MB,
        free_bytes=configuration.min_free_mb * MB,
    )
    return Recording(folder, format, limits)


def main() -> int:
    """Runs the node; returns its exit code."""
    return run("recorder", RecorderNode)


if __name__ == "__main__":
    sys.exit(main())
