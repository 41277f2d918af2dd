"""Reads a dataset: scene by scene, each when it is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import overload

import msgspec

from ros_scenesense.errors import DatasetError, FrameError, ParameterError
from ros_scenesense.simulation.dataset import images
from ros_scenesense.simulation.dataset.folder import DatasetFolder, IndexEntry, Line, checksum
from ros_scenesense.simulation.dataset.record import SceneRecord, scene_of
from ros_scenesense.simulation.engine import SimulatedScene


class DatasetReader(Sequence[SimulatedScene]):
    """The scenes of a complete dataset, as they were simulated.

    Depth is as exact as it is kept, 0.05 mm. Files are compared with their checksums when read.

    Attributes:
        metadata: What the dataset is.

    Args:
        path: Folder of the dataset.

    Raises:
        DatasetError: If it is no dataset, or scenes are missing.
    """

    def __init__(self, path: Path) -> None:
        self._folder = DatasetFolder(path)
        self.metadata = self._folder.read_metadata()
        self._records = self._folder.read_lines(self._folder.records)
        self._entries = self._folder.read_lines(self._folder.index)
        made = min(len(self._records), len(self._entries))
        if made < self.metadata.count:
            raise DatasetError(
                f"'{path}' has {made} of {self.metadata.count} scenes: generate it again with the "
                "same options, which makes the others"
            )

    def __len__(self) -> int:
        return self.metadata.count

    @overload
    def __getitem__(self, index: int) -> SimulatedScene: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[SimulatedScene]: ...

    def __getitem__(self, index: int | slice) -> SimulatedScene | Sequence[SimulatedScene]:
        """A scene, or a list of them.

        Raises:
            IndexError: If there is no such scene.
            DatasetError: If one of its files is damaged or missing; the text names it.
        """
        if isinstance(index, slice):
            return [self[number] for number in range(*index.indices(len(self)))]
        number = range(len(self))[index]
        record = self.record(number)
        entry = self._decoded(self._folder.index, self._entries, number, IndexEntry)
        files = {}
        for kind in images.KINDS:
            files[kind] = self._folder.read_image(kind, number)
            if checksum(files[kind]) != getattr(entry, kind):
                raise DatasetError(f"'{self._folder.image(kind, number)}' is damaged: {_MEND}")
        try:
            return scene_of(record, images.decode(files))
        except (DatasetError, FrameError) as error:
            raise DatasetError(f"'{self._folder.path}' scene {number}: {error}") from error

    def record(self, index: int) -> SceneRecord:
        """A scene without its images.

        Raises:
            IndexError: If there is no such scene.
            DatasetError: If its line is damaged; the text names it.
        """
        number = range(len(self))[index]
        return self._decoded(self._folder.records, self._records, number, SceneRecord)

    def records(self) -> Iterator[SceneRecord]:
        """All scenes without their images."""
        return (self.record(index) for index in range(len(self)))

    def _decoded(self, path: Path, lines: list[bytes], number: int, kind: type[Line]) -> Line:
        try:
            content = msgspec.json.decode(lines[number], type=kind)
        except (msgspec.MsgspecError, UnicodeError) as error:
            raise DatasetError(
                f"'{path}' line {number + 1} is damaged: {error}; {_MEND}"
            ) from error
        if content.index != number:
            raise DatasetError(
                f"'{path}' line {number + 1} is scene {content.index}, must be {number}: {_MEND}"
            )
        return content


def spread_evenly(reader: DatasetReader, count: int, arrangement: str | None = None) -> list[int]:
    """Numbers of at most so many scenes, spread evenly over the dataset.

    Raises:
        ParameterError: If there is none of the arrangement.
    """
    kinds = [record.arrangement for record in reader.records()]
    numbers = [i for i, kind in enumerate(kinds) if arrangement in (None, kind)]
    if not numbers:
        raise ParameterError(
            f"--arrangement is {arrangement!r}, the dataset has {', '.join(sorted(set(kinds)))}"
        )
    count = min(count, len(numbers))
    return [numbers[i * len(numbers) // count] for i in range(count)]


_MEND = "generate the dataset again with the same options, which makes this scene anew"
