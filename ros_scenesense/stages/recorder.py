"""The recorder: begins and ends bags, and counts what they hold and what was dropped.

Bags are written by a `Recording` that the caller makes, since they are ROS's own files; the state
of the other stages goes into each bag as it was when the bag began.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ros_scenesense.errors import SceneSenseError
from ros_scenesense.parameters import parameter
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import Figure, Incoming, Job, Outgoing
from ros_scenesense.stages.sessions import new_session
from ros_scenesense.stages.state_archive import export_state

STATE_IN_BAG = "state.zip"
MB = 1_000_000
_CLOSE_S = 8.0
_FIGURES_NS = 1_000_000_000


@dataclass(frozen=True)
class RecorderConfiguration:
    """Parameters of the recorder."""

    bag_dir: str = parameter("bags", "folder that gets a new bag for every recording")
    autostart: bool = parameter(
        True, "record from the start on; else when the service recorder/start is called"
    )
    storage: str = parameter(
        "mcap",
        "file format of bags; of one in sqlite3 less is left if the recorder is killed",
        choices=("mcap", "sqlite3"),
    )
    compression: str = parameter(
        "none", "compression of an mcap bag; zstd costs computing time", choices=("none", "zstd")
    )
    topics: str = parameter(
        "",
        "topics to record, comma-separated, relative names below the namespace; empty = all. "
        "`timing/*` stands for all that begin so",
    )
    leave_out: str = parameter("", "topics not to record, written likewise")
    file_mb: int = parameter(
        1000, "megabytes after which a bag goes on in a new file; 0 = never", minimum=0
    )
    bag_mb: int = parameter(0, "megabytes after which the recording ends; 0 = never", minimum=0)
    min_free_mb: int = parameter(
        500, "the recording ends when the disk has less megabytes left", minimum=0
    )
    queue_mb: int = parameter(
        64, "megabytes that may wait to be written; what does not fit is dropped", minimum=1
    )
    state_dir: str = parameter(
        "", "state folder of the graph, which every bag gets a copy of; empty = none"
    )


class Recording(Protocol):
    """A bag that is being written; see `bags.recording.Recording`."""

    @property
    def folder(self) -> Path:
        """Of the bag."""

    @property
    def dropped(self) -> Mapping[str, int]:
        """Messages that found no place in the queue, by topic."""

    @property
    def counts(self) -> Any:
        """Messages, payload bytes and files so far."""

    @property
    def waiting_bytes(self) -> int:
        """What waits to be written."""

    @property
    def ended(self) -> str | None:
        """Why nothing is written any more; None while it is."""

    def add_topic(self, topic: Any) -> None:
        """Announces a topic; must precede its messages."""

    def put(self, topic: str, stamp_ns: int, data: bytes) -> bool:
        """Queues a message; returns whether there was room for it."""

    def close(self, timeout_s: float) -> bool:
        """Finishes the bag; returns whether that was done in time."""


class RecorderStage:
    """Records what the node hands it.

    Args:
        configuration: Its parameters.
        begin_recording: Makes the recording of a folder that does not exist yet.
        say: Tells people where a bag is, and what it holds when it is finished.

    Attributes:
        health: Counters and problems.
    """

    def __init__(
        self,
        configuration: RecorderConfiguration,
        begin_recording: Callable[[RecorderConfiguration, Path], Recording],
        say: Callable[[str], None] = lambda _words: None,
    ) -> None:
        self.configuration = configuration
        self.health = Health()
        self._begin_recording = begin_recording
        self._say = say
        self._recording: Recording | None = None
        self._topics: dict[str, Any] = {}
        self._told_ns = 0
        self._counted_messages = 0

    def engine(self) -> None:
        """There are no jobs."""
        return

    def start(self, now_ns: int) -> list[Outgoing]:
        """Begins a bag if that is wanted."""
        if self.configuration.autostart:
            done, words = self.begin()
            if not done:
                self.health.problem("not_recording", words)
        return self._figures(now_ns)

    def begin(self) -> tuple[bool, str]:
        """Begins a bag; returns whether it did, and where it is or why not."""
        if self._recording is not None:
            return False, f"recording already: {self._recording.folder}"
        folder = self._new_folder()
        try:
            recording = self._begin_recording(self.configuration, folder)
        except SceneSenseError as error:
            return False, str(error)
        self._recording, self._counted_messages = recording, 0
        for topic in self._topics.values():
            recording.add_topic(topic)
        self._export_state(folder)
        self.health.count("bags")
        self._say(f"recording to {folder}")
        return True, str(folder)

    def end(self) -> tuple[bool, str]:
        """Finishes the bag; returns whether that was done, and what it holds."""
        recording = self._recording
        if recording is None:
            return False, "nothing is recorded"
        finished = recording.close(_CLOSE_S)
        self._count(recording)
        counts, lost = recording.counts, sum(recording.dropped.values())
        words = (
            f"{recording.folder}: {counts.messages} messages, "
            f"{counts.payload_bytes / MB:.1f} MB, {lost} dropped"
        )
        self._recording = None
        if not finished:
            words = f"{words}; it is still being written"
            self.health.problem("not_closed", words)
        self._say(words)
        return finished, words

    def add_topic(self, topic: Any) -> None:
        """Announces a topic; must precede its messages."""
        self._topics[topic.name] = topic
        if self._recording is not None:
            self._recording.add_topic(topic)

    def record(self, topic: str, stamp_ns: int, data: bytes) -> None:
        """Records a message if a bag is open."""
        if self._recording is None or self._recording.put(topic, stamp_ns, data):
            return
        if self._recording.ended is None:
            self.health.problem(
                "dropped",
                f"a message on {topic} is not recorded: {self.configuration.queue_mb} MB wait to "
                "be written; record fewer topics, to a faster disk, or raise queue_mb",
            )

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes no message this way: what is recorded is not decoded."""
        del item, now_ns
        return []

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Ends a recording that reached a limit; tells its figures once a second."""
        recording = self._recording
        if recording is not None and recording.ended is not None:
            self.health.problem("recording_ended", recording.ended)
            self.end()
        if now_ns - self._told_ns < _FIGURES_NS:
            return []
        return self._figures(now_ns)

    def jobs(self) -> list[Job]:
        """There are none: writing has a thread of its own."""
        return []

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """There are no jobs to finish."""
        del job, result, now_ns
        return []

    def close(self) -> None:
        """Finishes the bag."""
        if self._recording is not None:
            self.end()

    def _new_folder(self) -> Path:
        parent = Path(self.configuration.bag_dir).expanduser()
        return parent / f"bag-{new_session()}"

    def _export_state(self, folder: Path) -> None:
        if not self.configuration.state_dir:
            return
        try:
            export_state(Path(self.configuration.state_dir).expanduser(), folder / STATE_IN_BAG)
        except SceneSenseError as error:
            self.health.problem("state_not_kept", f"bag {folder} has no state: {error}")

    def _figures(self, now_ns: int) -> list[Outgoing]:
        self._told_ns = now_ns
        recording = self._recording
        if recording is None:
            return []
        self._count(recording)
        written = recording.counts.payload_bytes / MB
        return [
            Figure("recorder/bag_mb", written),
            Figure("recorder/waiting_mb", recording.waiting_bytes / MB),
            Figure("recorder/dropped", float(sum(recording.dropped.values()))),
        ]

    def _count(self, recording: Recording) -> None:
        messages = recording.counts.messages
        self.health.count("messages_recorded", messages - self._counted_messages)
        self._counted_messages = messages
