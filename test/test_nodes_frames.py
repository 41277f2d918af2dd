"""Frames on their way through four image topics: joined by stamp, wrong or missing ones told."""

import dataclasses

import numpy as np
import pytest
from rclpy.node import Node
from sensor_msgs.msg import Image

from ros_scenesense.geometry import Intrinsics
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.frames import (
    TOPIC_OF_PART,
    FrameJoining,
    FramePublisher,
    FrameSubscription,
)
from ros_scenesense.nodes.lean_node import LeanNode
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.scene import Frame
from ros_scenesense.stages.health import Health

TIMEOUT_S = 0.2


def a_frame(stamp_ns: int = 1) -> Frame:
    generator = np.random.default_rng(stamp_ns)
    return Frame(
        stamp_ns=stamp_ns,
        frame_id="camera_color_optical_frame",
        color=generator.integers(0, 256, (3, 4, 3), dtype=np.uint8),
        depth=generator.random((3, 4), dtype=np.float32),
        intrinsics=Intrinsics(width=4, height=3, fx=10.0, fy=11.0, cx=1.5, cy=1.0),
        instances=generator.integers(0, 5, (3, 4), dtype=np.uint16),
    )


class Camera:
    """Publishes frames to a subscription; `spoil` changes a part's messages on their way."""

    def __init__(self, room, reliability="reliable", **joining):
        self.room = room
        self.health = Health()
        self.frames = []
        sender = room.add(Node, "sender")
        self.receiver = room.add(Node, "receiver")
        self.publisher = FramePublisher(sender)
        self.subscription = FrameSubscription(
            self.receiver,
            self.health,
            self.frames.append,
            FrameJoining(reliability, TIMEOUT_S, **joining),
        )
        heard = [
            publisher
            for part, publisher in self.publisher.publishers.items()
            if part != "instances" or joining.get("with_instances", True)
        ]
        assert room.wait_for(lambda: all(each.get_subscription_count() for each in heard))

    def spoil(self, part, change):
        publish = self.publisher.publishers[part].publish
        self.publisher.publishers[part] = Spoiled(publish, change)

    def wait_for_problem(self, kind):
        def there():
            self.subscription.expire(self.receiver.get_clock().now().nanoseconds)
            return self.health.counters[kind] > 0

        return self.room.wait_for(there)


class Spoiled:
    def __init__(self, publish, change):
        self._publish, self._change = publish, change

    def publish(self, message):
        changed = self._change(message)
        if changed is not None:
            self._publish(changed)


def changed(**values):
    def change(message: Image) -> Image:
        for name, value in values.items():
            setattr(message, name, value)
        return message

    return change


@pytest.fixture
def camera(ros_room):
    return Camera(ros_room)


def test_frames_arrive_as_they_were_sent(camera):
    sent = [a_frame(stamp_ns) for stamp_ns in (1, 2_000_000_001)]
    for frame in sent:
        camera.publisher.publish(frame)
    assert camera.room.wait_for(lambda: len(camera.frames) == 2)
    for frame, received in zip(sent, camera.frames, strict=True):
        for field in dataclasses.fields(Frame):
            np.testing.assert_array_equal(getattr(received, field.name), getattr(frame, field.name))
    assert not camera.health.counters


def test_a_driver_that_publishes_best_effort_is_heard(ros_room):
    camera = Camera(ros_room, "best_effort")
    assert ros_room.wait_for(lambda: camera.publisher.publish(a_frame()) or camera.frames)


def test_a_frame_that_is_shown_again_arrives_again(camera):
    camera.publisher.publish(a_frame())
    camera.publisher.publish(a_frame())
    assert camera.room.wait_for(lambda: len(camera.frames) == 2)


@pytest.mark.parametrize("part", list(TOPIC_OF_PART))
def test_a_missing_part_is_named(camera, part):
    camera.spoil(part, lambda _message: None)
    camera.publisher.publish(a_frame())
    assert camera.wait_for_problem("incomplete_frame")
    assert TOPIC_OF_PART[part] in camera.health.last_problem
    others = set(TOPIC_OF_PART.values()) - {TOPIC_OF_PART[part]}
    assert not any(topic in camera.health.last_problem for topic in others)
    assert camera.frames == []


@pytest.mark.parametrize(
    ("part", "change", "kind"),
    [
        ("color", changed(encoding="yuv422"), "bad_color"),
        ("depth", changed(height=0, width=0, step=0, data=b""), "bad_depth"),
        ("depth", changed(data=b"\x00"), "bad_depth"),
        ("instances", changed(is_bigendian=1), "bad_instances"),
        ("camera_info", changed(k=[float("nan")] * 9), "bad_camera_info"),
        ("camera_info", changed(width=5), "bad_frame"),
        ("camera_info", changed(k=[0.0] * 9), "bad_frame"),
    ],
)
def test_a_wrong_part_drops_its_frame_with_one_problem(camera, part, change, kind):
    camera.spoil(
        part, lambda message: change(message) if message.header.stamp.sec == 0 else message
    )
    camera.publisher.publish(a_frame(1))
    camera.publisher.publish(a_frame(1_000_000_000))
    assert camera.room.wait_for(lambda: len(camera.frames) == 1)
    assert camera.frames[0].stamp_ns == 1_000_000_000
    assert camera.wait_for_problem(kind)
    assert dict(camera.health.counters) == {kind: 1}


def test_without_instances_a_frame_is_complete_with_colour_depth_and_camera_info(ros_room):
    camera = Camera(ros_room, with_instances=False)
    camera.publisher.publish(a_frame())
    assert camera.room.wait_for(lambda: camera.frames)
    assert camera.frames[0].instances is None
    np.testing.assert_array_equal(camera.frames[0].depth, a_frame().depth)


def shifted(nanoseconds):
    def change(message):
        message.header.stamp.nanosec += nanoseconds
        return message

    return change


def test_images_whose_stamps_lie_apart_are_joined_within_the_slop(ros_room):
    camera = Camera(ros_room, slop_s=0.01)
    camera.spoil("depth", shifted(4_000_000))
    camera.spoil("camera_info", shifted(-3_000_000))
    sent = [a_frame(stamp_ns) for stamp_ns in (500_000_000, 533_000_000, 566_000_000)]
    for frame in sent:
        camera.publisher.publish(frame)
    assert camera.room.wait_for(lambda: len(camera.frames) == 3)
    for frame, received in zip(sent, camera.frames, strict=True):
        assert received.stamp_ns == frame.stamp_ns
        np.testing.assert_array_equal(received.depth, frame.depth)
        np.testing.assert_array_equal(received.color, frame.color)


def test_images_whose_stamps_lie_farther_apart_are_no_frame(ros_room):
    camera = Camera(ros_room, slop_s=0.01)
    camera.spoil("depth", shifted(11_000_000))
    camera.publisher.publish(a_frame(500_000_000))
    assert camera.wait_for_problem("incomplete_frame")
    assert "image_slop_s" in camera.health.last_problem
    assert camera.frames == []


def test_a_camera_of_another_quality_of_service_is_told_with_the_mend(ros_room):
    profile = profile_of(QosClass.FRAME, "best_effort")
    ros_room.add(Node, "driver").create_publisher(Image, TOPIC_OF_PART["depth"], profile)
    health = Health()
    joining = FrameJoining("reliable", TIMEOUT_S)
    FrameSubscription(ros_room.add(LeanNode, "receiver"), health, list, joining)
    assert ros_room.wait_for(lambda: health.counters["incompatible_camera"])
    assert TOPIC_OF_PART["depth"] in health.last_problem
    assert "image_reliability" in health.last_problem


def test_a_lean_node_gives_the_executor_no_events_to_look_after(ros_room):
    lean, plain = ros_room.add(LeanNode, "lean"), ros_room.add(Node, "plain")
    for node in (lean, plain):
        node.create_publisher(Image, "image", 1)
        node.create_subscription(Image, "image", list, 1)
    assert len(list(plain.waitables)) > len(list(lean.waitables)) == 0
