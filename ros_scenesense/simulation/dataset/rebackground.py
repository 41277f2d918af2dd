"""Puts the scenes of a dataset before other backgrounds: another colour image, nothing else.

So an estimator can be asked what it has learned of the objects and what of the table: labels,
depth, instances and everything that the records say but the background stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import msgspec
import numpy as np

from ros_scenesense.errors import DatasetError
from ros_scenesense.simulation.backgrounds import PLAIN, recomposite
from ros_scenesense.simulation.configuration import check
from ros_scenesense.simulation.dataset import images
from ros_scenesense.simulation.dataset.folder import DatasetFolder, MadeScene
from ros_scenesense.simulation.dataset.generation import Report, write_missing
from ros_scenesense.simulation.dataset.metadata import Metadata, installed_versions
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.dataset.workers import parts_of, run_by_workers


def rebackground(
    source: Path,
    path: Path,
    backgrounds: int,
    jobs: int = 1,
    report: Report = lambda _done, _count: None,
) -> int:
    """Makes the scenes that are missing or broken in a dataset that differs in backgrounds.

    Args:
        source: A complete dataset. From the plain background nothing is lost; from another one,
            the light on the table is only as exact as its pixels.
        path: Folder of the new dataset: new, empty, or one of the same source and backgrounds.
        backgrounds: How many there are; every scene draws one. 0 = plain.
        jobs: Number of worker processes; 1 works in this process.
        report: Told of the progress.

    Returns:
        Number of scenes that were made.

    Raises:
        DatasetError: If the source is incomplete or damaged, or the new folder holds something
            else, is in use, or cannot be written.
        ParameterError: If there are not so many backgrounds.
    """
    if source.resolve() == path.resolve():
        raise DatasetError(f"'{path}' is the source itself: choose another folder for the result")
    reader = DatasetReader(source)
    metadata = _described(reader.metadata, backgrounds)

    def make(indices: Sequence[int]) -> Iterator[MadeScene]:
        if jobs == 1:
            yield from _made(reader, source, metadata, indices)
            return
        work = partial(_made_by_worker, source, metadata)
        for part in run_by_workers(work, parts_of(indices, _SCENES_PER_JOB, jobs), jobs):
            yield from part

    return write_missing(path, metadata, make, report)


def _described(source: Metadata, backgrounds: int) -> Metadata:
    """The dataset of the source's scenes before so many backgrounds."""
    configuration = replace(source.configuration, backgrounds=backgrounds)
    check(configuration)
    here = installed_versions()
    return msgspec.structs.replace(
        source,
        configuration=configuration,
        # Whatever simulated the source still decides about all but the colours.
        versions=source.versions | {name: here[name] for name in _COMPOSING},
        source=source.fingerprint(),
    )


_COMPOSING = ("ros_scenesense", "numpy", "opencv")


_SCENES_PER_JOB = 20


def _made_by_worker(source: Path, metadata: Metadata, indices: Sequence[int]) -> list[MadeScene]:
    return list(_made(_reader_of_worker(source), source, metadata, indices))


@lru_cache(maxsize=1)
def _reader_of_worker(source: Path) -> DatasetReader:
    return DatasetReader(source)


def _made(
    reader: DatasetReader, source: Path, metadata: Metadata, indices: Sequence[int]
) -> Iterator[MadeScene]:
    folder = DatasetFolder(source)
    for index in indices:
        scene, record = reader[index], reader.record(index)
        number = _draw(metadata, index)
        color = recomposite(scene.frame, number, record.background)
        files = {kind: folder.read_image(kind, index) for kind in images.KINDS}
        files["color"] = images.encode(replace(scene.frame, color=color))["color"]
        line = msgspec.json.encode(msgspec.structs.replace(record, background=number))
        yield MadeScene(index, line, files)


def _draw(metadata: Metadata, index: int) -> int:
    """Number of the background, from 1 on; the plain one if there are none."""
    count = metadata.configuration.backgrounds
    if not count:
        return PLAIN
    rng = np.random.default_rng([metadata.seed, index, *b"rebackground"])
    return int(rng.integers(1, count + 1))
