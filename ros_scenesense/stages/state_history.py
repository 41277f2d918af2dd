"""What a state folder remembers, in numbers, and what was learned when."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from ros_scenesense.errors import MessageError, StateError
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.grounding import Trust
from ros_scenesense.stages.state_catalogue import STATE_FILES
from ros_scenesense.stages.state_file import read_state_file

# What happens to every axiom in every cycle tells nothing.
_EVERYDAY = ("faded", "used", "learned again")
_NETWORK = "network-"

Item = TypeVar("Item")


@dataclass(frozen=True)
class Learned:
    """Something that was learned, or unlearned.

    Attributes:
        stamp_ns: When; 0 = nobody wrote it down.
        node: Which node learned it.
        words: What it was.
    """

    stamp_ns: int
    node: str
    words: str


def contents(folder: Path, name: str) -> str:
    """What a state file holds, in a few words.

    Raises:
        StateError: If it is not there, or cannot be read.
    """
    return "; ".join(_read(folder, name, _CONTENTS[name]))


def history(folder: Path) -> list[Learned]:
    """What was learned when, oldest first; files that are not there are passed over.

    Raises:
        StateError: If a state file cannot be read.
    """
    found: list[Learned] = []
    for name, read in _HISTORIES.items():
        if (folder / name).is_file():
            node = STATE_FILES[name].node
            found += [Learned(stamp, node, words) for stamp, words in _read(folder, name, read)]
    return sorted(found, key=lambda each: each.stamp_ns)


def _read(
    folder: Path, name: str, read: Callable[[sqlite3.Connection], Iterator[Item]]
) -> list[Item]:
    try:
        with read_state_file(folder / name, STATE_FILES[name].version) as connection:
            return list(read(connection))
    except MessageError as error:
        raise StateError(f"{folder / name} cannot be read: {error}") from error


def _count(connection: sqlite3.Connection, what: str) -> int:
    return int(connection.execute(f"SELECT count(*) FROM {what}").fetchone()[0])


def _of_camera(connection: sqlite3.Connection) -> Iterator[str]:
    sessions = connection.execute("SELECT count(DISTINCT session) FROM scene").fetchone()[0]
    yield f"{_count(connection, 'scene')} scenes of {sessions} sessions"
    yield f"{_count(connection, 'answer')} actions"


def _of_own_scenes(connection: sqlite3.Connection) -> Iterator[str]:
    yield f"{_count(connection, 'session')} sessions"


def _of_grounding(connection: sqlite3.Connection) -> Iterator[str]:
    row = connection.execute("SELECT applied FROM learned").fetchone()
    yield f"{0 if row is None else row[0]} updates applied"
    yield f"{_count(connection, 'told')} words of people"
    yield f"histograms of {_count(connection, 'scene')} scenes"


def _of_control(connection: sqlite3.Connection) -> Iterator[str]:
    yield f"{_count(connection, 'feedback')} words of people"
    yield f"{_count(connection, 'msr_update')} updates to be applied"
    yield f"{_count(connection, 'content')} scenes"


def _of_reasoner(connection: sqlite3.Connection) -> Iterator[str]:
    yield f"{_count(connection, 'goal')} goals"
    yield f"{_count(connection, 'step')} actions"


def _of_attention(connection: sqlite3.Connection) -> Iterator[str]:
    yield f"{_count(connection, 'example')} examples of {_count(connection, 'judged')} scenes"
    yield f"{_count(connection, 'network')} networks"


def _of_learner(connection: sqlite3.Connection) -> Iterator[str]:
    active = _count(connection, "axiom WHERE state = 'active'")
    yield f"{active} axioms in force, {_count(connection, 'axiom') - active} before"
    yield f"{_count(connection, 'scene')} labelled scenes"
    yield f"{connection.execute('SELECT cycle FROM progress').fetchone()[0]} cycles"


def _feedback_and_trust(connection: sqlite3.Connection) -> Iterator[tuple[int, str]]:
    for stamp_ns, object, reference, relation, scene_id in connection.execute(
        "SELECT stamp_ns, object, reference, relation, scene_id FROM feedback ORDER BY number"
    ):
        yield stamp_ns, f"was told {relation}({object}, {reference}) of {scene_id}"
    for (text,) in connection.execute("SELECT message FROM trust ORDER BY revision"):
        trust = decode(text, Trust)
        yield (
            trust.stamp.nanoseconds,
            f"trust {trust.revision}: {trust.qsr:.2f} in the rule, {trust.msr:.2f} in what was "
            "learned",
        )


def _goals(connection: sqlite3.Connection) -> Iterator[tuple[int, str]]:
    for stamp_ns, text, outcome in connection.execute(
        "SELECT stamp_ns, text, outcome FROM goal ORDER BY stamp_ns"
    ):
        yield stamp_ns, f"goal {text}: {outcome or 'open'}"


def _networks(connection: sqlite3.Connection) -> Iterator[tuple[int, str]]:
    for revision, examples, loss in connection.execute(
        "SELECT revision, examples, loss FROM network ORDER BY number"
    ):
        # A network that was trained here is named after the time.
        time = revision.removeprefix(_NETWORK)
        stamp_ns = int(time) if revision.startswith(_NETWORK) and time.isdecimal() else 0
        held_out = "" if loss is None else f", loss {loss:.3f} on what was held out"
        yield stamp_ns, f"{revision} adopted: {examples} examples{held_out}"


def _axioms(connection: sqlite3.Connection) -> Iterator[tuple[int, str]]:
    for stamp_ns, cycle, axiom, what, words in connection.execute(
        "SELECT stamp_ns, cycle, axiom, what, words FROM event ORDER BY number"
    ):
        if what not in _EVERYDAY:
            yield stamp_ns, f"cycle {cycle}: {axiom} {what}{f': {words}' if words else ''}"


_CONTENTS: dict[str, Callable[[sqlite3.Connection], Iterator[str]]] = {
    "camera.db": _of_camera,
    "grounding_scenes.db": _of_own_scenes,
    "grounding.db": _of_grounding,
    "control.db": _of_control,
    "reasoner.db": _of_reasoner,
    "attention.db": _of_attention,
    "learner.db": _of_learner,
}
_HISTORIES: dict[str, Callable[[sqlite3.Connection], Iterator[tuple[int, str]]]] = {
    "control.db": _feedback_and_trust,
    "reasoner.db": _goals,
    "attention.db": _networks,
    "learner.db": _axioms,
}
