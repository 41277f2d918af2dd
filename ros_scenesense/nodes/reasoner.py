"""The node `reasoner`: decides stability and occlusion; shows its decisions as markers."""

from __future__ import annotations

import sys
from typing import Any

from visualization_msgs.msg import MarkerArray

from ros_scenesense.messages.actions import Action, ActionResult, Goal, Plan, Transition
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.learning import Axioms
from ros_scenesense.messages.reasoning import Beliefs, Explanation, Knowledge, Query, Verdicts
from ros_scenesense.messages.scenes import Labels, Scene
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.base import StageNode
from ros_scenesense.nodes.markers import markers_of
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.running import run
from ros_scenesense.stages.join import SceneJoin
from ros_scenesense.stages.protocol import Incoming
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage

_PARTS: dict[type[Any], str] = {Objects: "objects", Relations: "relations", Beliefs: "beliefs"}


class ReasonerNode(StageNode):
    """Gives `ReasonerStage` its topics, and RViz its markers."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__(
            "reasoner",
            ReasonerConfiguration,
            ReasonerStage,
            subscribes=(Scene, Relations, Objects, Labels, Axioms, Query, Goal, ActionResult),
            publishes=(
                Beliefs,
                Verdicts,
                Knowledge,
                Explanation,
                Plan,
                Action,
                Transition,
            ),
            **node_options,
        )

    def connect(self) -> None:
        """Adds the markers of the newest scene."""
        super().connect()
        self._unmarked: dict[str, Any] | None = None
        self._marked = SceneJoin(tuple(_PARTS.values()), timeout_s=60.0)
        self._markers = self.create_publisher(MarkerArray, "markers", profile_of(QosClass.STATE))
        self._publish_beliefs = self.publish_as[Beliefs]
        self.publish_as[Beliefs] = self._publish_with_markers

    def take(self, item: Incoming) -> None:
        """Keeps what the markers are made of."""
        if isinstance(item, Objects | Relations):
            self._mark(item)
        super().take(item)

    def tick(self) -> None:
        """Forgets the markers of undecided scenes; draws only while somebody looks."""
        self._marked.expired(self.get_clock().now().nanoseconds)
        self._show_markers()
        super().tick()

    def _publish_with_markers(self, beliefs: Beliefs) -> None:
        self._publish_beliefs(beliefs)
        self._mark(beliefs)

    def _mark(self, item: Objects | Relations | Beliefs) -> None:
        now_ns = self.get_clock().now().nanoseconds
        parts = self._marked.add(item.scene_id, _PARTS[type(item)], item, now_ns)
        if parts is not None:
            self._unmarked = parts
            self._show_markers()

    def _show_markers(self) -> None:
        # The newest scene waits for the first who looks; who comes later gets what was published.
        if self._unmarked is not None and self.has_subscribers(self._markers):
            self._markers.publish(markers_of(**self._unmarked))
            self._unmarked = None


def main() -> int:
    """Runs the node; returns its exit code."""
    return run("reasoner", ReasonerNode)


if __name__ == "__main__":
    sys.exit(main())
