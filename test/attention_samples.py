"""The attention stage on simulated scenes, and examples for it."""

import itertools

import numpy as np

from ros_scenesense.attention.inputs import NUMBERS
from ros_scenesense.attention.queries import Query
from ros_scenesense.messages.reasoning import Beliefs
from ros_scenesense.parameters import build
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.scene import Task
from ros_scenesense.stages.attention import SIDE, AttentionConfiguration, AttentionStage
from ros_scenesense.stages.attention_store import AttentionStore
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)
from ros_scenesense.stages.worker import InlineRunner

SECOND = 1_000_000_000
WITHHELD = "s1,s2,s3,o1,o2,o3"
ATTENTION = {"network": "none", "iterations": 30}


def stage_with(**values) -> AttentionStage:
    return AttentionStage(build(AttentionConfiguration, ATTENTION | values))


def run(scenes=4, mode="training", withheld=WITHHELD, **attention) -> tuple[list, AttentionStage]:
    """Everything that the stages publish of simulated scenes, and the attention stage."""
    stage = stage_with(**attention)
    camera = {
        "session": "s",
        "width": 160,
        "height": 120,
        "scenes": scenes,
        "mode": mode,
        "seed": 3,
    }
    pipeline = Pipeline(
        [
            SimulatedCameraStage(build(SimulatedCameraConfiguration, camera)),
            GroundingStage(GroundingConfiguration()),
            GroundingControlStage(GroundingControlConfiguration()),
            ReasonerStage(ReasonerConfiguration(withheld=withheld)),
            stage,
        ],
        itertools.count(1).__next__,
    )
    try:
        return list(pipeline.run()), stage
    finally:
        pipeline.close()


def of(kind, published):
    return [item for item in published if isinstance(item, kind)]


def undecided(published):
    return {
        (item.scene_id, each.name, task)
        for item in of(Beliefs, published)
        for each in item.objects
        for task, belief in ((Task.STABILITY, each.stable), (Task.OCCLUSION, each.occluded))
        if belief.value is None
    }


def teach(state, scenes=40, first=0):
    """Examples of bright stable and dark unstable objects, two of each scene."""
    store = AttentionStore(state / "attention.db", Health(), SIDE)
    rng = np.random.default_rng(0)
    for number in range(first, first + scenes):
        examples = []
        for bright in (0, 1):
            image = rng.random((6, SIDE, SIDE)).astype(np.float32) * 0.3 + 0.5 * bright
            query = Query(Task.STABILITY, f"o{bright}", image, np.zeros(NUMBERS, np.float32), ())
            examples.append((query, bool(bright)))
        assert store.add(f"t-{number}", [("s3", number > 9)], examples)
    store.close()


def run_jobs(stage, now_ns=SECOND):
    """Runs all that the stage wants done, until it wants no more; returns what it publishes."""
    published = []
    runner = InlineRunner(
        stage.engine(), lambda job, result: published.extend(stage.finish(job, result, now_ns))
    )
    while jobs := stage.jobs():
        for job in jobs:
            runner.submit(job)
    runner.close()
    return published
