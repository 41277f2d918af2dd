"""Shows labelled scenes to the whole loop in one process, so that attention collects examples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ros_scenesense.messages.reasoning import Verdicts
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.stages.attention import (
    LARGEST_POOL,
    AttentionConfiguration,
    AttentionStage,
)
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)


def collect_examples(
    camera: SimulatedCameraConfiguration,
    reasoner: ReasonerConfiguration,
    state_dir: str,
    report: Callable[[int], None] = lambda _scenes: None,
) -> int:
    """Fills `attention.db` with the examples of simulated or recorded scenes.

    Args:
        camera: Which scenes.
        reasoner: With which knowledge; what it leaves undecided becomes examples.
        state_dir: Folder of `attention.db`.
        report: Called with the number of scenes judged so far.

    Returns:
        How many scenes were judged.
    """
    pipeline = Pipeline(
        [
            SimulatedCameraStage(replace(camera, mode="training", session="train")),
            GroundingStage(GroundingConfiguration()),
            GroundingControlStage(GroundingControlConfiguration()),
            ReasonerStage(reasoner),
            AttentionStage(
                AttentionConfiguration(
                    network="none", state_dir=state_dir, pool_examples=LARGEST_POOL
                )
            ),
        ]
    )
    judged = 0
    try:
        for item in pipeline.run():
            if isinstance(item, Verdicts):
                judged += 1
                report(judged)
    finally:
        pipeline.close()
    return judged
