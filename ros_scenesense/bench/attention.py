"""Regions of interest, queries, and the training of the query network: in this process, one thread.

The scenes are simulated with the noise of a Kinect; reasoning lacks six axioms, so that nearly
every literal is in question.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ros_scenesense.attention.queries import SeenScene, queries_of, regions_of
from ros_scenesense.attention.relevance import Relevance
from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.experiments.estimation_samples import WAYS, samples_of
from ros_scenesense.experiments.estimation_scenes import NOISE, Looker
from ros_scenesense.results import Table
from ros_scenesense.scene import Task
from ros_scenesense.stages.attention import SIDE
from ros_scenesense.stages.camera_engine import CameraEngine, SimulatedCameraConfiguration

if TYPE_CHECKING:
    from ros_scenesense.attention.networks.answers import TrainedNetwork

FIGURES = (
    Figure(
        "roi_ms", "the regions of interest of a scene with 5 objects, median, ms CPU", at_most=10.0
    ),
    Figure(
        "infer_scene_ms",
        "the query network's answers to all queries of such a scene, median, ms CPU",
        at_most=15.0,
    ),
    Figure(
        "train_100_s",
        "training of the query network on what 100 scenes leave open, s CPU",
        at_most=120.0,
    ),
)
_KNOWLEDGE = "incomplete"
_OBJECTS = 5
_REPEATS = 3


def measure(options: BenchOptions) -> Measured:
    """Shows simulated scenes to the loop, trains on them, and asks about those with 5 objects."""
    from ros_scenesense.attention.networks.query import QueryNetworkConfiguration
    from ros_scenesense.attention.networks.training import query_training, train

    camera = CameraEngine(SimulatedCameraConfiguration(noise=NOISE))
    looker = Looker(camera, options.seed)
    images = 6 if options.quick else 100
    shown = 1 if options.quick else 30
    try:
        views = [looker.look(number) for number in range(images)]
        scenes: list[SeenScene] = []
        number = images
        while len(scenes) < shown:
            simulated, seen = looker.see(number)
            number += 1
            if len(simulated.objects) == _OBJECTS:
                scenes.append(seen[_KNOWLEDGE])
    finally:
        looker.close()
        camera.close()
    samples = samples_of(WAYS["query"], views, _KNOWLEDGE)
    schedule = query_training(10 if options.quick else 600, options.seed)
    start = time.process_time()
    trained = train(QueryNetworkConfiguration(side=SIDE), samples, schedule)
    training_s = time.process_time() - start
    timings = _timings(trained, scenes, looker.relevances[_KNOWLEDGE])
    figures = {name: float(np.median(values)) for name, values in timings.items()}
    rows: list[list[str | int | float | None]] = [
        [name, len(values), float(np.median(values)), float(np.percentile(values, 95.0))]
        for name, values in timings.items()
    ]
    return Measured(
        {**figures, "train_100_s": training_s},
        {"Attention": Table(columns=["figure", "measurements", "median ms", "95 % ms"], rows=rows)},
    )


def _timings(
    trained: TrainedNetwork, scenes: list[SeenScene], relevances: Mapping[Task, Relevance]
) -> dict[str, list[float]]:
    """Milliseconds of CPU time of each step for each scene, several times."""
    timings: dict[str, list[float]] = {"roi_ms": [], "queries_ms": [], "infer_scene_ms": []}
    for scene in scenes * _REPEATS:
        start = time.process_time()
        rois = [
            roi
            for task, relevance in relevances.items()
            for roi in regions_of(scene, relevance, scene.undecided(task))
        ]
        found = time.process_time()
        queries = queries_of(scene, relevances, rois, SIDE)
        images = np.stack([query.image for query in queries])
        numbers = np.stack([query.numbers for query in queries])
        cut = time.process_time()
        trained.probabilities(images, numbers)
        answered = time.process_time()
        for name, seconds in zip(
            timings, (found - start, cut - found, answered - cut), strict=True
        ):
            timings[name].append(1e3 * seconds)
    return timings
