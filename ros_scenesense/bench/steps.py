"""Grounding and classification of one scene with five objects: in this process, one at a time."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.results import Table
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.grounding_engine import GroundingConfiguration, GroundingEngine
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage

FIGURES = (
    Figure(
        "relations_ms_5",
        "all relations of a 320x240 frame with 5 objects, from depth and instances, median, ms",
        at_most=60.0,
    ),
    Figure(
        "decide_ms_5",
        "the reasoner's step for such a scene, from its messages to beliefs, median, ms",
        at_most=10.0,
    ),
)
_OBJECTS = 5
_REPEATS = 3


@dataclass(frozen=True)
class _Sample:
    """A scene with five objects, and what grounding and control say of it."""

    frame: Frame
    scene: Scene
    objects: Objects
    relations: Relations


def measure(options: BenchOptions) -> Measured:
    """Times both steps on simulated scenes of all arrangements."""
    count = 5 if options.quick else 40
    grounding = GroundingEngine(GroundingConfiguration())
    samples = list(_samples(count, options.seed, grounding))
    timings: dict[str, list[float]] = {"relations_ms_5": [], "decide_ms_5": []}
    for _ in range(_REPEATS):
        timings["relations_ms_5"] += [_time_grounding(grounding, sample) for sample in samples]
        timings["decide_ms_5"] += _time_classification(samples)
    rows: list[list[str | int | float | None]] = []
    for name, milliseconds in timings.items():
        p50, p95 = np.percentile(milliseconds, [50.0, 95.0])
        rows.append([name, len(milliseconds), float(p50), float(p95), max(milliseconds)])
    columns = ["figure", "measurements", "median ms", "95 % ms", "longest ms"]
    return Measured(
        figures={name: float(np.median(values)) for name, values in timings.items()},
        tables={f"Steps, scenes with {_OBJECTS} objects": Table(columns=columns, rows=rows)},
    )


def _samples(count: int, seed: int, grounding: GroundingEngine) -> Iterator[_Sample]:
    simulation = SimulationEngine(SimulationConfiguration())
    control = GroundingControlStage(GroundingControlConfiguration())
    found, index = 0, 0
    try:
        while found < count:
            simulated = simulation.scene(seed, index)
            index += 1
            if len(simulated.objects) != _OBJECTS:
                continue
            found += 1
            scene = Scene(
                stamp=Stamp.of(index),
                scene_id=f"bench-{index:04d}",
                mode="testing",
                objects=simulated.objects,
                camera_pose=simulated.frame.camera_pose,
            )
            result = grounding.ground(simulated.frame, scene)
            (relations,) = (
                item for item in control.handle(result.groundings, 0) if isinstance(item, Relations)
            )
            yield _Sample(simulated.frame, scene, result.objects, relations)
    finally:
        simulation.close()


def _time_grounding(grounding: GroundingEngine, sample: _Sample) -> float:
    start = time.perf_counter()
    grounding.ground(sample.frame, sample.scene)
    return (time.perf_counter() - start) * 1e3


def _time_classification(samples: list[_Sample]) -> Iterator[float]:
    reasoner = ReasonerStage(ReasonerConfiguration())
    try:
        for sample in samples:
            reasoner.handle(sample.scene, 0)
            reasoner.handle(sample.objects, 0)
            # The last part completes the scene: its classification runs inside this call.
            start = time.perf_counter()
            reasoner.handle(sample.relations, 0)
            yield (time.perf_counter() - start) * 1e3
    finally:
        reasoner.close()
