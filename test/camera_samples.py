"""A camera stage whose scenes need no renderer."""

from __future__ import annotations

import numpy as np

from ros_scenesense.geometry import Intrinsics
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.parameters import build
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.engine import SimulatedScene
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)

SECOND = 1_000_000_000


def camera(**values) -> SimulatedCameraStage:
    return SimulatedCameraStage(build(SimulatedCameraConfiguration, {"session": "s", **values}))


def rendered() -> tuple[SimulatedScene, float]:
    frame = Frame(
        stamp_ns=0,
        frame_id="camera_color_optical_frame",
        color=np.zeros((2, 3, 3), np.uint8),
        depth=np.ones((2, 3), np.float32),
        intrinsics=Intrinsics(width=3, height=2, fx=1.0, fy=1.0, cx=1.0, cy=1.0),
        instances=np.zeros((2, 3), np.uint16),
    )
    scene = SimulatedScene(
        frame=frame,
        objects=[],
        object_labels=[],
        structure_labels=[],
        arrangement="spread",
        supports=[],
        placed=[],
    )
    return scene, 0.01


def render_all(stage: SimulatedCameraStage, now_ns: int) -> list:
    """Renders until the camera wants no more; returns what it published."""
    published = []
    while jobs := stage.jobs():
        for job in jobs:
            published += stage.finish(job, rendered(), now_ns)
    return published


def estimates(scene_id: str) -> Estimates:
    return Estimates(
        stamp=Stamp.of(1),
        scene_id=scene_id,
        objects=[],
        structures=[],
        knowledge_revision="k",
        trust_revision=0,
    )


def shown_ids(published: list) -> list[str]:
    return [item.scene_id for item in published if isinstance(item, Scene)]
