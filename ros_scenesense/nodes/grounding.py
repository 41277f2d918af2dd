"""The node `grounding`: takes frames and scenes, publishes objects and grounded relations."""

from __future__ import annotations

import sys
from typing import Any

from sensor_msgs.msg import Image, PointCloud2
from std_srvs.srv import Trigger

from ros_scenesense.messages.grounding import Groundings, MsrUpdate, Objects
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.base import StageNode
from ros_scenesense.nodes.configurations import GroundingNodeConfiguration
from ros_scenesense.nodes.conversions import cloud_message, header_of, image_message
from ros_scenesense.nodes.frames import FrameJoining, FrameSubscription
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.running import run
from ros_scenesense.stages.grounding import GroundingStage
from ros_scenesense.stages.grounding_engine import SELF
from ros_scenesense.stages.protocol import Cloud, Segmentation


class GroundingNode(StageNode):
    """Gives `GroundingStage` its images."""

    stage: GroundingStage
    configuration: GroundingNodeConfiguration

    def __init__(self, **node_options: Any) -> None:
        super().__init__(
            "grounding",
            GroundingNodeConfiguration,
            GroundingStage,
            subscribes=(Scene, MsrUpdate),
            publishes=(Groundings, Objects),
            **node_options,
        )

    def connect(self) -> None:
        """Adds the images of the camera, the segmentation, the cloud and the services."""
        super().connect()
        configuration = self.configuration
        joining = FrameJoining(
            configuration.image_reliability,
            configuration.image_timeout_s,
            configuration.image_slop_s,
            with_instances=not configuration.segments,
        )
        self._frames = FrameSubscription(self, self.health, self.take, joining)
        if configuration.scene_source == SELF:
            self._open_publisher(Scene)
        self.create_service(Trigger, "grounding/capture", self._capture)
        self.create_service(Trigger, "grounding/camera_moved", self._camera_moved)
        self._segmentation = self.create_publisher(
            Image, "segmentation", profile_of(QosClass.FRAME)
        )
        self._cloud = self.create_publisher(PointCloud2, "cloud", profile_of(QosClass.FRAME))
        self.publish_as[Segmentation] = self._publish_segmentation
        self.publish_as[Cloud] = lambda cloud: self._cloud.publish(cloud_message(cloud))

    def tick(self) -> None:
        """Gives up incomplete frames; has a cloud built only while somebody looks."""
        self._frames.expire(self.get_clock().now().nanoseconds)
        self.stage.cloud_wanted = self.has_subscribers(self._cloud)
        super().tick()

    def _capture(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        answer = self._guarded(self.stage.capture, self.get_clock().now().nanoseconds)
        scene_id, words = answer or (None, "failed: see the node's log")
        response.success, response.message = scene_id is not None, words
        return response

    def _camera_moved(
        self, _request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        answer = self._guarded(self.stage.camera_moved)
        response.success, response.message = answer or (False, "failed: see the node's log")
        return response

    def _publish_segmentation(self, segmentation: Segmentation) -> None:
        header = header_of(segmentation.stamp_ns, segmentation.frame_id)
        self._segmentation.publish(image_message(header, segmentation.instances, "16UC1"))


def main() -> int:
    """Runs the node; returns its exit code."""
    return run("grounding", GroundingNode)


if __name__ == "__main__":
    sys.exit(main())
