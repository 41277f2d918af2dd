"""The node `attention`: looks where reasoning is undecided, and publishes the final decisions."""

from __future__ import annotations

import sys

from sensor_msgs.msg import Image
from std_srvs.srv import Trigger

from ros_scenesense.errors import FrameError
from ros_scenesense.messages.attention import Estimates, Examples, Rois
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.learning import JobProgress
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, Verdicts
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.annotated_image import AnnotatedImages
from ros_scenesense.nodes.base import StageNode
from ros_scenesense.nodes.configurations import AttentionNodeConfiguration
from ros_scenesense.nodes.conversions import header_of, image_message, instances_of, stamp_of
from ros_scenesense.nodes.frames import FrameJoining, FrameSubscription
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.running import run
from ros_scenesense.stages.attention import AttentionStage
from ros_scenesense.stages.protocol import Incoming, Outgoing, Segmentation


class AttentionNode(StageNode):
    """Gives `AttentionStage` its images, its service, and people a picture."""

    stage: AttentionStage
    configuration: AttentionNodeConfiguration

    def __init__(self, **node_options: object) -> None:
        super().__init__(
            "attention",
            AttentionNodeConfiguration,
            AttentionStage,
            subscribes=(Beliefs, Verdicts, Relations, Objects, Knowledge),
            publishes=(Rois, Estimates, Examples, JobProgress),
            **node_options,
        )

    def connect(self) -> None:
        """Adds the images of the camera, the segmentation, the picture and the service."""
        super().connect()
        configuration = self.configuration
        joining = FrameJoining(
            configuration.image_reliability,
            configuration.image_timeout_s,
            configuration.image_slop_s,
            with_instances=False,
        )
        self._frames = FrameSubscription(self, self.health, self.take, joining)
        frames = profile_of(QosClass.FRAME)
        self.create_subscription(Image, "segmentation", self._take_segmentation, frames)
        self._pictures = AnnotatedImages()
        self._annotated = self.create_publisher(Image, "annotated_image", frames)
        self.create_service(Trigger, "attention/train", self._train)

    def tick(self) -> None:
        """Gives up incomplete frames; draws only while somebody looks."""
        now_ns = self.get_clock().now().nanoseconds
        self._frames.expire(now_ns)
        self._pictures.expire(now_ns)
        self._pictures.wanted = self.has_subscribers(self._annotated)
        super().tick()

    def take(self, item: Incoming) -> None:
        """Keeps what the picture is made of."""
        self._draw(item)
        super().take(item)

    def publish(self, item: Outgoing) -> None:
        """Keeps what the picture shows."""
        super().publish(item)
        self._draw(item)

    def _draw(self, item: Incoming | Outgoing) -> None:
        done = self._pictures.add(item, self.get_clock().now().nanoseconds)
        if done is not None:
            frame, picture = done
            header = header_of(frame.stamp_ns, frame.frame_id)
            self._annotated.publish(image_message(header, picture, "rgb8"))

    def _take_segmentation(self, message: Image) -> None:
        header = message.header
        try:
            instances = instances_of(message)
        except FrameError as error:
            words = f"segmentation of stamp {stamp_of(header)} ns is dropped: {error}"
            self.health.problem("bad_segmentation", words)
            return
        self.take(Segmentation(stamp_of(header), header.frame_id, instances))

    def _train(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        answer = self._guarded(self.stage.train, self.get_clock().now().nanoseconds)
        job_id, words = answer or (None, "failed: see the node's log")
        response.success, response.message = job_id is not None, words
        return response


def main() -> int:
    """Runs the node; returns its exit code."""
    return run("attention", AttentionNode)


if __name__ == "__main__":
    sys.exit(main())
