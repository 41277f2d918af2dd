"""The node `simulated_camera`: shows scenes, paced by `estimates`; executes `action` in them."""

from __future__ import annotations

import operator
import sys
from collections.abc import Callable
from typing import Any

from rclpy.qos import QoSProfile
from std_srvs.srv import Trigger

from ros_scenesense.messages.actions import Action, ActionResult, Goal, Plan
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.scenes import Labels, Scene, SceneLost
from ros_scenesense.nodes.base import StageNode
from ros_scenesense.nodes.conversions import transform_message
from ros_scenesense.nodes.frames import TOPIC_OF_PART, FramePublisher
from ros_scenesense.nodes.running import run
from ros_scenesense.scene import Frame
from ros_scenesense.stages.protocol import Outgoing
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # it comes with a full ROS 2, not with the wheels
    TFMessage = None

WORLD_FRAME = "world"


class SimulatedCameraNode(StageNode):
    """Gives `SimulatedCameraStage` its images, `/tf` and services."""

    stage: SimulatedCameraStage

    def __init__(self, **node_options: Any) -> None:
        super().__init__(
            "simulated_camera",
            SimulatedCameraConfiguration,
            SimulatedCameraStage,
            subscribes=(Estimates, Action, Goal, Plan),
            publishes=(Scene, Labels, SceneLost, ActionResult),
            **node_options,
        )

    def connect(self) -> None:
        """Adds the images, `/tf` and the services."""
        super().connect()
        self._takers = [0] * len(TOPIC_OF_PART)
        self._newcomer = False
        self._frames = FramePublisher(self)
        self.publish_as[Frame] = self._publish_frame
        self._transforms = None
        if TFMessage is None:
            self.get_logger().info("tf2_msgs is not installed: /tf is not published")
        else:
            self._transforms = self.create_publisher(TFMessage, "/tf", QoSProfile(depth=100))
        self._serve("next_scene", self.stage.next_scene, "one more scene will be shown")
        self._serve("reset", self.stage.reset, "a new session begins")

    def tick(self) -> None:
        """Shows nothing before somebody takes all the images; shows again what newcomers missed."""
        self.stage.audience = self.has_subscribers(*self._frames.publishers.values())
        self._greet()
        super().tick()

    def _greet(self) -> None:
        takers = [each.get_subscription_count() for each in self._frames.publishers.values()]
        before, self._takers = self._takers, takers
        if takers != before:
            # It may not have found all the images yet: the next tick is soon enough.
            self._newcomer |= any(map(operator.gt, takers, before))
        elif self._newcomer:
            self._newcomer = False
            self.call(self.stage.show_again)

    def _serve(self, name: str, method: Callable[[int], list[Outgoing]], answer: str) -> None:
        def serve(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            response.success = self.call(method)
            response.message = answer if response.success else "failed: see the node's log"
            return response

        self.create_service(Trigger, name, serve)

    def _publish_frame(self, frame: Frame) -> None:
        pose = frame.camera_pose
        if self._transforms is not None and pose is not None:
            transform = transform_message(frame.stamp_ns, WORLD_FRAME, frame.frame_id, pose)
            self._transforms.publish(TFMessage(transforms=[transform]))
        self._frames.publish(frame)


def main() -> int:
    """Runs the node; returns its exit code."""
    return run("simulated_camera", SimulatedCameraNode)


if __name__ == "__main__":
    sys.exit(main())
