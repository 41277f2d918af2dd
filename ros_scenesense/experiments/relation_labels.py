"""The file in which a person's relation labels of real scenes are kept: JSON lines.

The first line names the format and the naming frame, every other line is one answer:

    {"schema": "relation_labels/1", "naming_frame": "viewer"}
    {"scene": "test12", "object": "object_1", "reference": "object_3", "relation": "left"}

An object is called `object_<id>` after its value in the annotation image. The relation is one of
the ten prepositions, or `unclear` where the person could not say.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from ros_scenesense.errors import DatasetError
from ros_scenesense.messages.grounding import RelationName
from ros_scenesense.results import write_atomically
from ros_scenesense.scene import Distance, NamingFrame, Position

UNCLEAR = "unclear"
_ObjectName = Annotated[str, msgspec.Meta(pattern=r"^object_[1-9][0-9]{0,4}$")]


class RelationLabel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`object` is `relation` of `reference`, says a person who looked at the scene."""

    scene: Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
    object: _ObjectName
    reference: _ObjectName
    relation: RelationName | Literal["unclear"]

    @property
    def pair(self) -> frozenset[str]:
        """The two objects, whichever is the reference."""
        return frozenset((self.object, self.reference))

    @property
    def position(self) -> Position | None:
        """The relation if it is one of position."""
        return Position(self.relation) if self.relation in set(Position) else None

    @property
    def distance(self) -> Distance | None:
        """The relation if it is one of distance."""
        return Distance(self.relation) if self.relation in set(Distance) else None


class _Header(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="schema"):
    naming_frame: NamingFrame


class _FileHeader(_Header, frozen=True, tag="relation_labels/1"):
    """First line of the file."""


def read_labels(path: Path) -> list[RelationLabel]:
    """The labels of a file, in its order; none if there is no such file.

    Raises:
        DatasetError: If a line is wrong, labels contradict each other, or the names are not those
            of the viewer; the text says which line.
    """
    try:
        lines = path.read_bytes().splitlines()
    except FileNotFoundError:
        return []
    except OSError as error:
        raise DatasetError(f"'{path}' cannot be read: {error.strerror}") from error
    labels: list[RelationLabel] = []
    seen: dict[tuple[str, frozenset[str], bool], int] = {}
    for number, line in enumerate(lines, start=1):
        try:
            if number == 1:
                _check_header(msgspec.json.decode(line, type=_FileHeader))
                continue
            if not line.strip():
                continue
            label = msgspec.json.decode(line, type=RelationLabel)
            _check(label, seen)
        except (msgspec.MsgspecError, ValueError) as error:
            raise DatasetError(f"'{path}', line {number}: {error}") from error
        seen[_place(label)] = number
        labels.append(label)
    return labels


def write_labels(path: Path, labels: Iterable[RelationLabel]) -> None:
    """Writes all labels; nobody ever sees half of the file.

    Raises:
        DatasetError: If the file cannot be written.
    """
    encoder = msgspec.json.Encoder()
    lines = [encoder.encode(_FileHeader(NamingFrame.VIEWER)), *map(encoder.encode, labels)]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, b"\n".join(lines) + b"\n")
    except OSError as error:
        raise DatasetError(f"'{path}' cannot be written: {error.strerror}") from error


def _check_header(header: _FileHeader) -> None:
    if header.naming_frame is not NamingFrame.VIEWER:
        raise ValueError(
            f"the relations are named in the frame '{header.naming_frame}', only those of the "
            "viewer are read"
        )


def _check(label: RelationLabel, seen: dict[tuple[str, frozenset[str], bool], int]) -> None:
    if label.object == label.reference:
        raise ValueError(f"'{label.object}' stands in a relation to itself")
    before = seen.get(_place(label))
    if before is not None:
        raise ValueError(
            f"the pair {label.object}, {label.reference} of scene '{label.scene}' has a label of "
            f"this kind in line {before} already: remove one"
        )


def _place(label: RelationLabel) -> tuple[str, frozenset[str], bool]:
    """A pair has one label of position (or `unclear`) and one of distance."""
    return label.scene, label.pair, label.distance is not None
