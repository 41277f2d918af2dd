"""How fast datasets are made, how near that is to the limit, and whether their labels last."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

import numpy as np

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.simulation.dataset.agreement import label_agreement
from ros_scenesense.simulation.dataset.generation import generate
from ros_scenesense.simulation.dataset.metadata import DatasetOptions, Metadata, describe
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.dataset.record import SceneRecord
from ros_scenesense.simulation.engine import SimulationConfiguration
from ros_scenesense.simulation.stability import stability
from ros_scenesense.simulation.view import draw_light

FIGURES = (
    Figure(
        "images_per_s",
        "labelled 320x240 scenes per second in a balanced dataset, one worker per core, from the "
        "start of the workers to the last file",
        at_least=12.5,
    ),
    Figure(
        "share_of_limit",
        "the same, as a share of what the cores could do if every scene were drawn rightly at once "
        "and only its pictures and its physics took time",
        at_least=0.6,
    ),
    Figure(
        "label_agreement",
        "share of the stability labels that are the same when they are made twice",
        at_least=0.99,
    ),
)


def measure(options: BenchOptions) -> Measured:
    """Makes a dataset in a temporary folder, and repeats the least work on some of its scenes."""
    count, sample = (20, 10) if options.quick else (360, 90)
    jobs = len(os.sched_getaffinity(0))
    metadata = describe(SimulationConfiguration(), DatasetOptions(count=count, seed=options.seed))
    with tempfile.TemporaryDirectory(prefix="scenesense-") as folder:
        start = time.perf_counter()
        generate(Path(folder, "dataset"), metadata, jobs)
        images_per_s = count / (time.perf_counter() - start)
        reader = DatasetReader(Path(folder, "dataset"))
        records = [reader.record(i * count // sample) for i in range(sample)]
    figures = {
        "images_per_s": images_per_s,
        "share_of_limit": images_per_s / (jobs / _least_seconds(records, metadata)),
    }
    agreement = label_agreement(records, options.seed).share
    if agreement is not None:
        figures["label_agreement"] = agreement
    return Measured(figures)


def _least_seconds(records: list[SceneRecord], metadata: Metadata) -> float:
    """Mean time per scene for the calls of physics and renderer that its truth needs."""
    from ros_scenesense.simulation.camera import Camera
    from ros_scenesense.simulation.world import World

    world = World()
    camera = Camera(world, records[0].intrinsics, metadata.configuration.shadows)
    rng = np.random.default_rng(metadata.seed)
    light = draw_light(rng)
    seconds = 0.0
    # The first time, meshes are loaded.
    for repeat in range(2):
        start = time.perf_counter()
        for record in records:
            bodies = world.build([placed.piece for placed in record.placed])
            stability(world, [tuple(label.members) for label in record.structure_labels], rng)
            world.reset()
            camera.picture(record.camera_pose, light)
            for body in bodies:
                world.show_only([body.piece.name])
                camera.bodies(record.camera_pose)
            world.reset()
        if repeat:
            seconds = (time.perf_counter() - start) / len(records)
    world.close()
    return seconds
