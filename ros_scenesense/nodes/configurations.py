"""Parameters that belong to nodes alone: what depends on how images travel. Imports no ROS."""

from __future__ import annotations

from dataclasses import dataclass

from ros_scenesense.parameters import parameter
from ros_scenesense.stages.attention import AttentionConfiguration
from ros_scenesense.stages.grounding import GroundingConfiguration


@dataclass(frozen=True)
class ImageTopics:
    """Parameters of every node that takes the camera's images."""

    image_reliability: str = parameter(
        "reliable",
        "quality of service of the images; best_effort for a camera driver that offers no better",
        choices=("reliable", "best_effort"),
    )
    image_timeout_s: float = parameter(
        2.0, "seconds to wait for all images of one stamp before they are given up", minimum=0.05
    )
    image_slop_s: float = parameter(
        0.0,
        "seconds that the stamps of the images of one frame may lie apart; less than half the time "
        "between two frames, 0 = they are equal",
        minimum=0.0,
        maximum=1.0,
    )


@dataclass(frozen=True)
class GroundingNodeConfiguration(ImageTopics, GroundingConfiguration):
    """Parameters of the grounding node: those of its stage, and of its image topics."""


@dataclass(frozen=True)
class AttentionNodeConfiguration(ImageTopics, AttentionConfiguration):
    """Parameters of the attention node: those of its stage, and of its image topics."""
