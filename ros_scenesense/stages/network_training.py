"""Which network attention uses, and how a better one comes to be used.

The folder `networks/` holds those that were adopted, and what a training leaves there while it is
under way: a candidate, a checkpoint, and files half written, none of which outlives its use.
"""

from __future__ import annotations

import tempfile
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Literal

from ros_scenesense.errors import NetworkError, ParameterError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.learning import JobProgress
from ros_scenesense.resources import resource
from ros_scenesense.stages.attention_engine import TrainingOrder, TrainingState
from ros_scenesense.stages.attention_store import AttentionStore, KnownNetwork
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import Job, JobFailure

SHIPPED = "shipped"
NONE = "none"
SHIPPED_NETWORK = "query.pt"

_CANDIDATE = "candidate.pt"
_LEFT_BEHIND = (_CANDIDATE, f".{_CANDIDATE}.*", "training*.pt", ".training*.pt.*")

# Seconds: the examples travel to the worker; a piece of a training.
_BEGIN_DEADLINE_S = 60.0
_PIECE_DEADLINE_S = 120.0


class NetworkTraining:
    """Trains networks on what the store holds, and adopts those that are better.

    Args:
        store: Keeps examples and the networks so far.
        state_dir: Folder of `networks/`; empty = they are forgotten at the end.
        first: What is used before a network was trained here: `shipped`, a file, or `none`.
        health: Takes problems.
        side: Pixels of the networks' inputs.
        iterations: Batches of a training at most.
        device: Where it is trained.
        seed: Of everything random.

    Attributes:
        network: The network in use; None if there is none.
        jobs: Work for the attention engine; whoever takes it empties the list.
    """

    def __init__(
        self,
        store: AttentionStore,
        state_dir: str,
        first: str,
        health: Health,
        *,
        side: int,
        iterations: int,
        device: str,
        seed: int,
    ) -> None:
        self.jobs: list[Job] = []
        self._store = store
        self._health = health
        self._side, self._iterations, self._device, self._seed = side, iterations, device, seed
        self._scratch = None if state_dir else tempfile.TemporaryDirectory()
        folder = self._scratch.name if self._scratch else state_dir
        self._folder = Path(folder).expanduser() / "networks"
        self._order: TrainingOrder | None = None
        self._revision = ""
        self._examples = 0
        self._examples_before = store.trained_on
        self.network = self._first_network(first)
        self._tidy_up()

    @property
    def under_way(self) -> bool:
        """Whether a network is being trained."""
        return self._order is not None

    @property
    def new_examples(self) -> int:
        """Examples that came since the last training began; one that was killed does not count."""
        return self._store.examples_ever - self._examples_before

    def begin(self, now_ns: int) -> tuple[str | None, str]:
        """Begins a training on all examples.

        Returns:
            The id of the job, or None; and the same in words for the caller.
        """
        if self._order is not None:
            return None, f"{self._revision} is under way"
        try:
            examples = self._store.training_set()
            examples.check()
        except NetworkError as error:
            return None, str(error)
        self._tidy_up()
        self._examples = len(examples)
        self._examples_before = self._store.examples_ever
        self._revision = f"network-{now_ns}"
        self._order = TrainingOrder(
            side=self._side,
            iterations=self._iterations,
            seed=self._seed,
            device=self._device,
            file=str(self._folder / _CANDIDATE),
            checkpoint=str(self._checkpoint),
            rival=None if self.network is None else self.network.file,
        )
        arguments = (self._order, examples)
        self.jobs.append(Job(self._revision, "begin", arguments, _BEGIN_DEADLINE_S))
        return self._revision, f"{self._revision} is trained on {self._examples} examples"

    def advance(self, result: TrainingState | JobFailure, now_ns: int) -> JobProgress | None:
        """Takes where the training is, and goes on with it or ends it."""
        if self._order is None:
            return None
        if isinstance(result, JobFailure) or result.finished:
            self._store.record_training(self._examples_before)
        if isinstance(result, JobFailure):
            Path(self._order.file).unlink(missing_ok=True)
            self._order = None
            words = f"{self._revision} was not trained, what was used before stays: {result.reason}"
            self._health.problem("training_failed", words)
            return self._progress("failed", 0.0, words, now_ns)
        if not result.finished:
            self.jobs.append(Job(self._revision, "advance", (), _PIECE_DEADLINE_S))
            return self._progress("running", result.share, "", now_ns)
        order, self._order = self._order, None
        return self._progress("done", 1.0, self._judge(order, result), now_ns)

    def close(self) -> None:
        """Removes what was not to be remembered."""
        if self._scratch is not None:
            self._scratch.cleanup()

    def _judge(self, order: TrainingOrder, result: TrainingState) -> str:
        """Uses the new network if it is better on what was held out; says what became of it."""
        before = "-" if result.rival_loss is None else f"{result.rival_loss:.3f}"
        words = f"loss on held-out examples {result.loss:.3f}, of the network before {before}"
        if not result.better:
            self._health.count("networks_rejected")
            Path(order.file).unlink(missing_ok=True)
            return f"{self._revision} is no better and not used: {words}"
        self._health.count("networks_adopted")
        file = Path(order.file).replace(self._folder / f"{self._revision}.pt")
        self.network = KnownNetwork(self._revision, str(file), self._examples, result.loss)
        self._store.adopt(self.network)
        return f"{self._revision} is used from now on: {words}"

    @property
    def _checkpoint(self) -> Path:
        """Of a training on the examples as they are now: another one cannot go on with it."""
        store = self._store
        return self._folder / f"training-{store.examples_ever}-{store.example_count}.pt"

    def _tidy_up(self) -> None:
        """Removes what a training that was killed left behind, but for what the next goes on with.

        Called while none is under way. Networks that were adopted stay.
        """
        for pattern in _LEFT_BEHIND:
            for path in self._folder.glob(pattern):
                if path != self._checkpoint:
                    path.unlink(missing_ok=True)

    def _progress(
        self, state: Literal["running", "done", "failed"], share: float, words: str, now_ns: int
    ) -> JobProgress:
        return JobProgress(
            stamp=Stamp.of(now_ns),
            job_id=self._revision,
            node="attention",
            state=state,
            progress=share,
            text=words,
        )

    def _first_network(self, first: str) -> KnownNetwork | None:
        """The network trained here last, else the one that is wanted.

        Raises:
            ParameterError: If the file does not exist.
        """
        known = self._store.network()
        if known is not None:
            # The state may have been brought here from elsewhere, with its networks.
            for file in (Path(known.file), self._folder / Path(known.file).name):
                if file.exists():
                    return replace(known, file=str(file))
        if known is not None:
            words = f"network {known.revision} is gone from '{known.file}': train again"
            self._health.problem("network_missing", words)
        if first == NONE:
            return None
        if first == SHIPPED:
            return KnownNetwork(SHIPPED, str(resource("config", SHIPPED_NETWORK)), 0, None)
        path = Path(first).expanduser()
        if not path.is_file():
            raise ParameterError(
                f"parameter 'network' is {first!r}, must be {SHIPPED}, {NONE}, or a file that "
                "`scenesense train` wrote"
            )
        # Its name alone would not tell two files apart.
        return KnownNetwork(f"{path.stem}-{zlib.crc32(path.read_bytes()):08x}", str(path), 0, None)
