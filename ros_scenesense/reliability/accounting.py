"""Holds what nodes had acknowledged against what their state files hold afterwards."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ros_scenesense.errors import NetworkError, SceneSenseError
from ros_scenesense.grounding.msr import MetricSettings
from ros_scenesense.messages.attention import Examples
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.messages.grounding import MsrUpdate, Trust
from ros_scenesense.messages.learning import Axioms, JobProgress
from ros_scenesense.parameters import build
from ros_scenesense.reliability.companion import Account
from ros_scenesense.stages.attention import AttentionConfiguration, AttentionStage
from ros_scenesense.stages.axiom_learner import AxiomLearnerConfiguration, AxiomLearnerStage
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.grounding_store import GroundingStore
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.learner_store import look_into as look_into_learner
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)

_STAGES: tuple[tuple[type[Any], type[Any]], ...] = (
    (SimulatedCameraStage, SimulatedCameraConfiguration),
    (GroundingStage, GroundingConfiguration),
    (GroundingControlStage, GroundingControlConfiguration),
    (ReasonerStage, ReasonerConfiguration),
    (AttentionStage, AttentionConfiguration),
    (AxiomLearnerStage, AxiomLearnerConfiguration),
)
_ADOPTED = "is used from now on"
MessageT = TypeVar("MessageT", bound=AnyMessage)


@dataclass(frozen=True)
class Item:
    """One kind of thing that was acknowledged.

    Attributes:
        what: In words.
        acknowledged: How many.
        found: How many there are on disk.
        lost: What is missing or different, each in words.
        doubled: What is there twice.
    """

    what: str
    acknowledged: int
    found: int
    lost: list[str] = field(default_factory=list)
    doubled: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Accounting:
    """What became of all that was acknowledged, and which files are damaged."""

    items: list[Item]
    corrupted: list[str]


def account_for(account: Account, state: Path) -> Accounting:
    """Examines the state folder of a graph that has ended.

    Args:
        account: What was heard, with all `Trust`, `MsrUpdate`, `Examples`, `Axioms` and
            `JobProgress`.
        state: The folder.
    """
    with _copy(state) as folder:
        corrupted = [*_damaged(folder), *_unreadable_networks(folder)]
        items = [
            _scenes(account, folder),
            _feedback(account, folder),
            _trust(account, folder),
            _histograms(account, folder),
            _examples(account, folder),
            _pool(account, folder),
            _axioms(account, folder),
            _networks(account, folder),
        ]
    return Accounting(items, corrupted)


def _scenes(account: Account, folder: Path) -> Item:
    rows = dict(_rows(folder / "camera.db", "SELECT session || '-' || number, state FROM scene"))
    states = {_padded(name): state for name, state in rows.items()}
    lost = [f"scene {each} has no decision and is not reported as lost" for each in account.waiting]
    lost += [
        f"scene {each} is '{states.get(each)}' in camera.db"
        for each in account.shown
        if each not in account.waiting and states.get(each) not in ("settled", "lost")
    ]
    return Item("scenes decided, or reported as lost", len(account.shown), len(states), lost)


def _feedback(account: Account, folder: Path) -> Item:
    counts = Counter(name for (name,) in _rows(folder / "control.db", "SELECT id FROM feedback"))
    said = [each.id for each in account.answered.values() if each.outcome != "refused"]
    return Item(
        "feedback",
        len(said),
        sum(counts.values()),
        [f"feedback {name} is not in control.db" for name in said if not counts[name]],
        [f"feedback {name} counts {count} times" for name, count in counts.items() if count > 1],
    )


def _trust(account: Account, folder: Path) -> Item:
    """The trust that the ledger gives, learned anew, is the last one that was published."""
    heard = max(_kept(account, Trust), key=lambda each: each.revision, default=None)
    stage = GroundingControlStage(build(GroundingControlConfiguration, {"state_dir": str(folder)}))
    found = next(item for item in stage.start(0) if isinstance(item, Trust))
    stage.close()
    lost = []
    if heard is not None and heard.revision > found.revision:
        lost = [f"trust of revision {heard.revision}: control.db has {found.revision}"]
    elif heard is not None and heard.revision == found.revision and heard.kinds != found.kinds:
        lost = [f"trust of revision {heard.revision} is another one when it is learned anew"]
    acknowledged = 0 if heard is None else heard.revision
    return Item("revisions of the trust", acknowledged, found.revision, lost)


def _histograms(account: Account, folder: Path) -> Item:
    """All evidence that was heard of, learned anew in its order, gives the same histograms."""
    updates = {int(each.id): each for each in _kept(account, MsrUpdate)}
    path = folder / "grounding.db"
    store = GroundingStore(path, Health(), 10_000, MetricSettings())
    applied, arrays = store.applied, store.memory.to_arrays()
    store.close()
    missing = sorted(set(range(1, applied + 1)) - set(updates))
    beyond = [number for number in updates if number > applied]
    lost = [f"update {number} of the histograms is not applied" for number in beyond]
    if missing:
        lost.append(f"updates {missing} were applied but never heard of: nothing to compare with")
        return Item("updates of the histograms", len(updates), applied, lost)
    with closing(sqlite3.connect(path)) as connection, connection:
        for table in ("learned", "taught", "told"):
            connection.execute(f"DELETE FROM {table}")
    again = GroundingStore(path, Health(), 10_000, MetricSettings())
    for number in range(1, applied + 1):
        again.apply(updates[number])
    anew = again.memory.to_arrays()
    again.close()
    lost += [
        f"histograms '{name}' are others when all evidence is learned anew"
        for name, array in arrays.items()
        if not np.array_equal(array, anew[name], equal_nan=True)
    ]
    return Item("updates of the histograms", len(updates), applied, lost)


def _examples(account: Account, folder: Path) -> Item:
    path = folder / "attention.db"
    judged = {name for (name,) in _rows(path, "SELECT scene_id FROM judged")}
    counts = Counter(
        tuple(row) for row in _rows(path, "SELECT scene_id, task, target FROM example")
    )
    heard = _kept(account, Examples)
    wanted = {(each.scene_id, str(one.task), one.target) for each in heard for one in each.examples}
    lost = [f"scene {each.scene_id} was judged" for each in heard if each.scene_id not in judged]
    lost += [f"example {' '.join(key)} is not in attention.db" for key in wanted - set(counts)]
    doubled = [f"example {' '.join(key)}" for key, count in counts.items() if count > 1]
    return Item("examples of the network", len(wanted), sum(counts.values()), lost, doubled)


def _pool(account: Account, folder: Path) -> Item:
    counts = Counter(name for (name,) in _rows(folder / "learner.db", "SELECT scene_id FROM scene"))
    kept = account.total("axiom_learner", "scenes_kept")
    found = sum(counts.values())
    lost = [f"{kept} scenes were kept in the pool of examples, it has {found}"]
    return Item(
        "scenes in the axiom learner's pool",
        kept,
        found,
        lost if kept > found else [],
        [f"scene {name} is kept {count} times" for name, count in counts.items() if count > 1],
    )


def _axioms(account: Account, folder: Path) -> Item:
    contents = look_into_learner(folder / "learner.db")
    heard = {each.id: each.text for message in _kept(account, Axioms) for each in message.axioms}
    stored = {each.id: each.text for each in contents.axioms}
    born = Counter(event.axiom for event in contents.history if event.what == "learned")
    lost = [
        f"axiom {name} is not in learner.db as it was published"
        for name, text in heard.items()
        if stored.get(name) != text
    ]
    lost += [f"axiom {name} has no history" for name in stored if not born[name]]
    newest = max((each.cycle for each in _kept(account, Axioms)), default=0)
    if contents.cycle < newest:
        lost.append(f"cycle {newest} of learning was published, learner.db knows {contents.cycle}")
    doubled = [
        f"axiom {name} was learned {count} times" for name, count in born.items() if count > 1
    ]
    return Item("axioms with their history", len(heard), len(stored), lost, doubled)


def _networks(account: Account, folder: Path) -> Item:
    stored = {
        revision: Path(file).name
        for revision, file in _rows(folder / "attention.db", "SELECT revision, file FROM network")
    }
    adopted = [
        each.job_id
        for each in _kept(account, JobProgress)
        if each.node == "attention" and each.state == "done" and _ADOPTED in each.text
    ]
    lost = [f"network {each} is not in attention.db" for each in adopted if each not in stored]
    lost += [
        f"network {revision} has no file"
        for revision, name in stored.items()
        if not (folder / "networks" / name).is_file()
    ]
    return Item("networks in use", len(adopted), len(stored), lost)


def _damaged(folder: Path) -> Iterator[str]:
    """State files that are damaged, were set aside, or that their stage does not take."""
    for path in sorted(folder.glob("*.broken-*")):
        yield f"{path.name} was set aside"
    for path in sorted(folder.glob("*.db")):
        with closing(sqlite3.connect(path)) as connection:
            try:
                said = [row[0] for row in connection.execute("PRAGMA integrity_check")]
            except sqlite3.DatabaseError as error:
                said = [str(error)]
        if said != ["ok"]:
            yield f"{path.name}: {'; '.join(said)}"
    for stage, configuration in _STAGES:
        try:
            opened = stage(build(configuration, {"state_dir": str(folder)}))
        except SceneSenseError as error:
            yield f"{stage.__name__} does not start: {error}"
            continue
        opened.close()
        for kind, words in opened.health.take_problems():
            if kind in ("state_set_aside", "state_unreadable", "network_missing"):
                yield f"{stage.__name__}: {words}"


def _unreadable_networks(folder: Path) -> Iterator[str]:
    from ros_scenesense.attention.networks import checkpoints

    for path in sorted((folder / "networks").glob("*.pt")):
        try:
            checkpoints.load(path)
        except NetworkError as error:
            yield str(error)


@contextmanager
def _copy(state: Path) -> Iterator[Path]:
    """A copy of the state, to be opened and changed; paths of networks in it are the copy's."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "state"
        shutil.copytree(state, folder)
        yield folder


def _rows(path: Path, query: str) -> Iterable[tuple[Any, ...]]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(query).fetchall()


def _kept(account: Account, kind: type[MessageT]) -> list[MessageT]:
    return [each for each in account.kept[kind].values() if isinstance(each, kind)]


def _padded(scene_id: str) -> str:
    session, _, number = scene_id.rpartition("-")
    return f"{session}-{int(number):04d}"
