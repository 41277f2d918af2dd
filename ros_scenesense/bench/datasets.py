"""How fast datasets are made, how near that is to the limit, and how true their labels are."""

from __future__ import annotations

import os
import tempfile
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.geometry import Pose
from ros_scenesense.results import Table
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.appearance import draw_appearance, dress
from ros_scenesense.simulation.arrangements import Layout
from ros_scenesense.simulation.dataset.agreement import label_agreement
from ros_scenesense.simulation.dataset.generation import generate
from ros_scenesense.simulation.dataset.metadata import DatasetOptions, Metadata, describe
from ros_scenesense.simulation.dataset.plan import Draw
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.dataset.record import SceneRecord
from ros_scenesense.simulation.dataset.statistics import Statistics, statistics
from ros_scenesense.simulation.engine import SimulationConfiguration
from ros_scenesense.simulation.occlusion import visibilities
from ros_scenesense.simulation.stability import repetitions
from ros_scenesense.simulation.view import draw_light
from ros_scenesense.simulation.wish import structures_of

if TYPE_CHECKING:
    from ros_scenesense.simulation.camera import Picture
    from ros_scenesense.simulation.world import World

_AXIOMS = {
    "p_stable_not_above": ("what is not above anything is stable", 0.99, None),
    "p_unstable_irregular_below": ("what has an irregular surface below is unstable", 0.97, None),
    "p_not_occluded_not_behind": ("what is not behind anything is not occluded", 0.99, None),
    "p_unstable_small_base": ("what has a small base is unstable", 0.70, 0.95),
    "p_unstable_tower_above_4": ("what is higher than fourth in a tower is unstable", 0.70, 0.95),
}
FIGURES = (
    Figure(
        "images_per_s",
        "labelled 320x240 scenes per second in a balanced dataset, one worker per core, from the "
        "start of the workers to the last file",
        at_least=12.5,
    ),
    Figure(
        "share_of_limit",
        "the same, as a share of what as many processes could do if every scene were drawn rightly "
        "at once and only physics and rendering took time that it cannot do without",
        at_least=0.6,
    ),
    Figure(
        "label_agreement",
        "share of the stability labels that are the same when they are made twice",
        at_least=0.99,
    ),
    *(
        Figure(name + suffix, f"share of objects, {draw} draw: {words}", least, most)
        for draw, suffix in ((Draw.BALANCED, ""), (Draw.NATURAL, "_natural"))
        for name, (words, least, most) in _AXIOMS.items()
    ),
)


def measure(options: BenchOptions) -> Measured:
    """Makes datasets in a temporary folder, and repeats the least work on some of their scenes."""
    count, natural_count, sample = (12, 6, 6) if options.quick else (900, 720, 120)
    jobs = len(os.sched_getaffinity(0))
    balanced = _made(Draw.BALANCED, count, options.seed, jobs)
    natural = _made(Draw.NATURAL, natural_count, options.seed, jobs)
    chosen = [balanced.records[i * count // sample] for i in range(sample)]
    seconds = _side_by_side(lambda part: _least_seconds(part, balanced.metadata), chosen, jobs)
    found = _side_by_side(lambda part: label_agreement(part, options.seed), chosen, jobs)
    kept = sum(agreement.kept for agreement in found)
    figures = {
        "images_per_s": balanced.images_per_s,
        "share_of_limit": balanced.images_per_s / sum(1.0 / one for one in seconds),
        "label_agreement": sum(agreement.agreed for agreement in found) / kept,
    }
    tables = {}
    for suffix, made in (("", balanced), ("_natural", natural)):
        truth = statistics(made.records)
        figures |= {n + suffix: truth.figures[n] for n in _AXIOMS if n in truth.figures}
        title = f"Axioms in physics, {made.metadata.draw} draw, {made.metadata.count} scenes"
        tables[title] = _table(truth)
    return Measured(figures, tables)


@dataclass(frozen=True)
class _Made:
    """A dataset that was made, and how fast."""

    metadata: Metadata
    records: list[SceneRecord]
    images_per_s: float


def _made(draw: Draw, count: int, seed: int, jobs: int) -> _Made:
    options = DatasetOptions(count=count, seed=seed, draw=str(draw))
    metadata = describe(SimulationConfiguration(), options)
    with tempfile.TemporaryDirectory(prefix="scenesense-") as folder:
        path = Path(folder, "dataset")
        start = time.perf_counter()
        generate(path, metadata, jobs)
        seconds = time.perf_counter() - start
        return _Made(metadata, list(DatasetReader(path).records()), count / seconds)


Found = TypeVar("Found")


def _side_by_side(
    function: Callable[[Sequence[SceneRecord]], Found], records: Sequence[SceneRecord], jobs: int
) -> list[Found]:
    """What the function finds in each of as many parts as there are processes."""
    from joblib import Parallel, delayed

    parts = [records[first::jobs] for first in range(min(jobs, len(records)))]
    return list(Parallel(n_jobs=jobs)(delayed(function)(part) for part in parts))


def _least_seconds(records: Sequence[SceneRecord], metadata: Metadata) -> float:
    """Mean time per scene for the calls of physics and renderer that it needs, and nothing else.

    Each scene is right at once. What stands alone needs no test of its own, and only what may be
    hidden a picture of its own; textures and background are a part of rendering.
    """
    from ros_scenesense.simulation.camera import Camera
    from ros_scenesense.simulation.world import World

    world = World()
    camera = Camera(world, records[0].intrinsics, metadata.configuration.shadows)
    rng = np.random.default_rng(metadata.seed)
    seconds = 0.0
    # The first time, meshes are loaded and backgrounds painted.
    for repeat in range(2):
        start = time.perf_counter()
        for record in records:
            layout = Layout(record.arrangement, tuple(placed.piece for placed in record.placed))
            world.build(layout.pieces)
            stacks = [names for names in structures_of(layout) if len(names) > 1]
            deque(repetitions(world, stacks, rng), maxlen=0)
            world.reset()
            picture = camera.picture(record.camera_pose, draw_light(rng))
            names = [piece.name for piece in layout.pieces]
            looks = draw_appearance(names, True, metadata.configuration.backgrounds, rng)
            visibilities(world, camera, record.camera_pose, layout, picture)
            dress(_frame(record, picture, world), _poses(record), looks)
        if repeat:
            seconds = (time.perf_counter() - start) / len(records)
    world.close()
    return seconds


def _frame(record: SceneRecord, picture: Picture, world: World) -> Frame:
    instances = np.zeros(picture.bodies.shape, dtype=np.uint16)
    for number, body in enumerate(world.bodies, 1):
        instances[picture.bodies == body.id] = number
    return Frame(
        stamp_ns=0,
        frame_id=record.frame_id,
        color=picture.color,
        depth=picture.depth,
        intrinsics=record.intrinsics,
        instances=instances,
        camera_pose=record.camera_pose,
    )


def _poses(record: SceneRecord) -> dict[str, Pose]:
    return {placed.piece.name: placed.pose for placed in record.placed}


def _table(truth: Statistics) -> Table:
    columns, rows = truth.tables["Axioms in physics"]
    return Table(columns=columns, rows=rows)
