"""A camera that only has colour, depth and camera info: from its frames to beliefs on the graph."""

import dataclasses
import os
from pathlib import Path

import pytest
from box_scenes import Block, render
from rclpy.node import Node
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger

from ros_scenesense.messages.grounding import Objects
from ros_scenesense.messages.reasoning import Beliefs
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.conversions import image_message, instances_of, stamp_of
from ros_scenesense.nodes.frames import FramePublisher
from ros_scenesense.nodes.grounding import GroundingNode
from ros_scenesense.nodes.grounding_control import GroundingControlNode
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.reasoner import ReasonerNode
from ros_scenesense.perceive.frame_files import read_frame

SECOND = 1_000_000_000
ROOT = Path(__file__).resolve().parent.parent
SAMPLES = Path(os.environ.get("SCENESENSE_SAMPLES", ROOT.parent / "shared" / "samples"))
BLOCKS = [Block("one", (0.0, 0.1, 0.0)), Block("two", (0.0, -0.15, 0.0))]
BARE = dataclasses.replace(render(BLOCKS), instances=None)


class Driver:
    """A camera driver and the graph behind it, without simulated camera and without `scene`."""

    def __init__(self, room, **parameters):
        self.room = room
        values = {"scene_source": "self", "image_timeout_s": 30.0, **parameters}
        self.reasoner = room.add(ReasonerNode)
        self.control = room.add(GroundingControlNode)
        self.grounding = room.add(GroundingNode, **values)
        self.probe = room.probe()
        self.publisher = FramePublisher(room.add(Node, "driver"))
        self.scenes = self.probe.collect(Scene)
        self.objects = self.probe.collect(Objects)
        self.beliefs = self.probe.collect(Beliefs)
        self.segmentations = self.probe.collect_raw(
            Image, "segmentation", profile_of(QosClass.FRAME)
        )
        self.client = self.probe.node.create_client(Trigger, "grounding/capture")
        parts = [part for name, part in self.publisher.publishers.items() if name != "instances"]
        assert room.wait_for(lambda: all(part.get_subscription_count() for part in parts))
        assert room.wait_for(self.client.service_is_ready)
        assert room.wait_for(lambda: self.grounding.vital_signs.warm)
        assert room.wait_for(lambda: self.probe.node.count_publishers("/scenesense/segmentation"))

    def show(self, frame, stamp_ns):
        self.publisher.publish(dataclasses.replace(frame, stamp_ns=stamp_ns))

    def capture(self) -> Trigger.Response:
        answer = self.client.call_async(Trigger.Request())
        assert self.room.wait_for(answer.done)
        return answer.result()

    def taken(self):
        """Frames that the stage has got and replaced or used; one more may be kept."""
        kinds = ("scenes_minted", "frames_dropped", "frames_passed_over")
        return sum(self.counted(kind) for kind in kinds)

    def counted(self, counter):
        return self.grounding.health.counters[counter]


def test_a_captured_frame_is_decided(ros_room):
    driver = Driver(ros_room)
    driver.show(BARE, SECOND)  # nobody asked for this one
    answer = driver.capture()
    assert answer.success
    driver.show(BARE, 2 * SECOND)
    assert ros_room.wait_for(lambda: driver.beliefs and driver.segmentations)
    (scene,), (objects,), (beliefs,) = driver.scenes, driver.objects, driver.beliefs
    assert scene.scene_id in answer.message
    assert scene.scene_id == objects.scene_id == beliefs.scene_id
    assert scene.stamp.nanoseconds == stamp_of(driver.segmentations[0].header) == 2 * SECOND
    assert [one.name for one in beliefs.objects] == ["object_1", "object_2"]
    assert all(one.box is not None for one in objects.objects)
    assert [one.stable.value for one in beliefs.objects] == [True, True]
    assert instances_of(driver.segmentations[0]).max() == 2


def test_of_a_running_stream_only_what_can_be_grounded_becomes_scenes(ros_room):
    driver = Driver(ros_room, capture_rate_hz=60.0)
    shown = 0
    while len(driver.beliefs) < 3:
        shown += 1
        driver.show(BARE, shown * SECOND)
        assert ros_room.wait_for(lambda shown=shown: driver.taken() >= shown - 1)
        assert shown < 5000
    assert ros_room.wait_for(lambda: len(driver.beliefs) == driver.counted("scenes_minted"))
    ids = [scene.scene_id for scene in driver.scenes]
    assert len(set(ids)) == len(ids)
    assert sorted(one.scene_id for one in driver.beliefs) == ids
    assert driver.counted("frames_dropped") > 0
    assert driver.counted("scenes_minted") < shown


def test_capture_says_where_scenes_come_from_if_they_are_announced(ros_room):
    answer = Driver(ros_room, scene_source="topic", instances="own").capture()
    assert not answer.success
    assert "scene_source" in answer.message


def test_millimetres_in_sixteen_bits_are_taken(ros_room):
    driver = Driver(ros_room, image_slop_s=0.01)
    driver.capture()
    depth = driver.publisher.publishers["depth"]
    publish = depth.publish

    def as_millimetres(message):
        metres = BARE.depth
        message.header.stamp.nanosec += 3_000_000
        publish(image_message(message.header, (metres * 1000).astype("uint16"), "16UC1"))

    driver.publisher.publishers["depth"] = type("Spoiled", (), {"publish": as_millimetres})
    driver.show(BARE, SECOND)
    assert ros_room.wait_for(lambda: driver.beliefs)
    assert len(driver.beliefs[0].objects) == 2


@pytest.mark.skipif(not SAMPLES.is_dir(), reason="the real sample frames are not here")
def test_real_frames_are_decided(ros_room):
    driver = Driver(ros_room)
    folder = SAMPLES / "uoc"
    for number, name in enumerate(("000000", "000004"), start=1):
        frame = read_frame(
            folder / f"{name}-color.png",
            folder / f"{name}-depth.png",
            folder / "camera_params.json",
        )
        assert driver.capture().success
        driver.show(frame, number * SECOND)
        assert ros_room.wait_for(lambda number=number: len(driver.beliefs) == number)
        beliefs = driver.beliefs[-1]
        assert len(beliefs.objects) >= 3
        located = [one for one in driver.objects[-1].objects if one.box is not None]
        assert len(located) == len(beliefs.objects)
        assert any(one.stable.value is not None for one in beliefs.objects)
    assert not [kind for kind in driver.grounding.health.counters if kind.endswith("_failed")]
