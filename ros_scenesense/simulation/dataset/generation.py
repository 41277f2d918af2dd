"""Makes a dataset: workers make scenes, this process alone writes.

A scene depends on the dataset's metadata and its own number only, so neither the number of workers
nor an interruption changes a byte. Workers hand back finished files; they need no common disk.
"""

from __future__ import annotations

import fcntl
import os
import platform
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import lru_cache, partial
from pathlib import Path

import msgspec

from ros_scenesense.errors import DatasetError
from ros_scenesense.simulation.arrangements import Arrangement
from ros_scenesense.simulation.dataset import images
from ros_scenesense.simulation.dataset.folder import DatasetFolder, MadeScene
from ros_scenesense.simulation.dataset.metadata import Metadata
from ros_scenesense.simulation.dataset.plan import wish_for
from ros_scenesense.simulation.dataset.record import record_of
from ros_scenesense.simulation.dataset.workers import parts_of, run_by_workers
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.object_sources import objects_fingerprint

Report = Callable[[int, int], None]
"""Takes the number of scenes that are there and of those that shall be, after each scene."""


def generate(
    path: Path,
    metadata: Metadata,
    jobs: int = 1,
    report: Report = lambda _done, _count: None,
    cluster: str | None = None,
) -> int:
    """Makes the scenes of a dataset that are missing or broken.

    Args:
        path: Folder of the dataset: new, empty, or one of the same metadata. The count may grow.
        metadata: What to make.
        jobs: Number of worker processes; 1 works in this process, which then grows by some
            kilobytes per scene.
        report: Told of the progress.
        cluster: Address of the scheduler of a Dask cluster, whose workers then do the work.

    Returns:
        Number of scenes that were made.

    Raises:
        DatasetError: If the folder holds something else, is in use, or cannot be written; if the
            workers or the cluster fail.
        SimulationError: If a scene cannot be made.
    """
    return write_missing(
        path, metadata, lambda indices: _made(metadata, indices, jobs, cluster), report
    )


def write_missing(
    path: Path,
    metadata: Metadata,
    make: Callable[[Sequence[int]], Iterable[MadeScene]],
    report: Report = lambda _done, _count: None,
) -> int:
    """Writes the scenes of a dataset that are missing or broken, however they are made.

    Args:
        path: Folder of the dataset: new, empty, or one of the same metadata. The count may grow.
        metadata: What the dataset is.
        make: Makes the scenes of these numbers, in this order.
        report: Told of the progress.

    Returns:
        Number of scenes that were written.

    Raises:
        DatasetError: If the folder holds something else, is in use, or cannot be written.
    """
    folder = DatasetFolder(path)
    with _held(path):
        whole = _prepare(folder, metadata)
        missing = [index for index in range(metadata.count) if index not in whole]
        in_order = not missing or max(whole, default=-1) < missing[0]
        fingerprint = metadata.fingerprint()
        report(len(whole), metadata.count)
        for made in make(missing):
            whole[made.index] = folder.append(made, fingerprint)
            report(len(whole), metadata.count)
        if not in_order:
            folder.write_lines(whole)
    return len(missing)


def make_scenes(metadata: Metadata, indices: Sequence[int]) -> list[MadeScene]:
    """Makes these scenes of a dataset, ready to be written: the job of a worker process.

    Raises:
        DatasetError: If the objects here are not those of the dataset.
        SimulationError: If a scene cannot be made.
    """
    engine = _engine_of_worker(metadata.configuration, metadata.objects)
    return [make_scene(engine, metadata, index) for index in indices]


def make_scene(engine: SimulationEngine, metadata: Metadata, index: int) -> MadeScene:
    """Makes a scene of a dataset with an engine of its configuration, ready to be written."""
    arrangement = Arrangement(metadata.configuration.arrangement)
    wish = wish_for(metadata.draw, arrangement, metadata.seed, index)
    scene = engine.scene(metadata.seed, index, wish)
    line = msgspec.json.encode(record_of(index, scene))
    return MadeScene(index, line, images.encode(scene.frame))


_SCENES_PER_JOB = 10
# Bullet keeps some memory of every scene it ever showed: after so many, a worker is replaced.
_SCENES_PER_WORKER = 2000


@lru_cache(maxsize=1)
def _engine_of_worker(configuration: SimulationConfiguration, objects: str) -> SimulationEngine:
    """Kept from job to job, for Bullet never gives back the memory of an engine's meshes."""
    here = objects_fingerprint(configuration.objects_dir, configuration.ycb_dir)
    if here != objects:
        raise DatasetError(
            f"{platform.node()} has other objects in objects_dir, ycb_dir or config/objects than "
            "the machine that writes the dataset: copy them there"
        )
    return SimulationEngine(configuration)


def _made(
    metadata: Metadata, indices: Sequence[int], jobs: int, cluster: str | None
) -> Iterator[MadeScene]:
    """The scenes in the order of the indices."""
    if cluster is not None:
        yield from _made_on_cluster(metadata, indices, cluster)
        return
    if jobs == 1:
        with closing(SimulationEngine(metadata.configuration)) as engine:
            for index in indices:
                yield make_scene(engine, metadata, index)
        return
    for share in parts_of(indices, jobs * _SCENES_PER_WORKER):
        parts = parts_of(share, _SCENES_PER_JOB, jobs)
        for part in run_by_workers(partial(make_scenes, metadata), parts, jobs):
            yield from part


def _made_on_cluster(
    metadata: Metadata, indices: Sequence[int], address: str
) -> Iterator[MadeScene]:
    from ros_scenesense.simulation.dataset.cluster import run_on_cluster

    parts = parts_of(indices, _SCENES_PER_JOB)
    for part in run_on_cluster(address, partial(make_scenes, metadata), parts, metadata.versions):
        yield from part


def _prepare(folder: DatasetFolder, metadata: Metadata) -> dict[int, tuple[bytes, bytes]]:
    """Makes the folder one of this dataset, and finds the lines of the scenes that are whole.

    Raises:
        DatasetError: If it is the folder of something else.
    """
    found = folder.examine()
    if folder.metadata.exists():
        before = folder.read_metadata()
        differences = before.differences(metadata)
        if differences:
            raise DatasetError(
                f"'{folder.path}' is another dataset: {'; '.join(differences)}. Choose another "
                "folder, or the same options and versions"
            )
        if before.count > metadata.count:
            raise DatasetError(
                f"'{folder.path}' has {before.count} scenes, more than {metadata.count}: a dataset "
                "can only grow"
            )
    elif found.fingerprints - {metadata.fingerprint()}:
        raise DatasetError(
            f"'{folder.path}' holds scenes that were made with other options or versions, and its "
            "metadata.json is missing: choose another folder"
        )
    elif not found.fingerprints and any(folder.path.iterdir()):
        raise DatasetError(
            f"'{folder.path}' holds files but no dataset: choose a folder that is new or empty"
        )
    content = msgspec.json.format(msgspec.json.encode(metadata), indent=2) + b"\n"
    if not folder.metadata.exists() or folder.metadata.read_bytes() != content:
        folder.write(folder.metadata, content)
    whole = {index: lines for index, lines in found.whole.items() if index < metadata.count}
    if not folder.has_lines_of(whole):
        folder.write_lines(whole)
    return whole


@contextmanager
def _held(path: Path) -> Iterator[None]:
    """Keeps other runs out of the folder, which is made if it is not there."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise DatasetError(f"'{path}' cannot be made or opened: {error.strerror}") from error
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise DatasetError(
            f"'{path}' is being written by another run: wait for it, or choose another folder"
        ) from error
    finally:
        os.close(handle)
