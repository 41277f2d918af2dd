"""The node `grounding_control`: settles on relations, takes feedback, and teaches grounding."""

from __future__ import annotations

import sys
from typing import Any

from ros_scenesense.messages.grounding import (
    Feedback,
    FeedbackResult,
    Groundings,
    MsrUpdate,
    Relations,
    Trust,
)
from ros_scenesense.nodes.base import StageNode
from ros_scenesense.nodes.running import run
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)


class GroundingControlNode(StageNode):
    """Gives `GroundingControlStage` its topics."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__(
            "grounding_control",
            GroundingControlConfiguration,
            GroundingControlStage,
            subscribes=(Groundings, Feedback),
            publishes=(Relations, Trust, FeedbackResult, MsrUpdate),
            **node_options,
        )


def main() -> int:
    """Runs the node; returns its exit code."""
    return run("grounding_control", GroundingControlNode)


if __name__ == "__main__":
    sys.exit(main())
