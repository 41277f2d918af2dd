"""The camera node and who takes its images; scenes are made without a renderer."""

import pytest
from camera_samples import rendered
from sensor_msgs.msg import CameraInfo, Image

from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes import base
from ros_scenesense.nodes.conversions import stamp_of
from ros_scenesense.nodes.frames import TOPIC_OF_PART
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode


class InstantWorker:
    """Finishes each job before the next call."""

    def __init__(self, _factory, done, warm, failed):
        del failed
        self._done = done
        warm()

    def submit(self, job):
        self._done(job, rendered())

    def close(self):
        pass


@pytest.fixture
def camera(ros_room, monkeypatch):
    monkeypatch.setattr(base, "WorkerProcess", InstantWorker)
    return ros_room.add(SimulatedCameraNode, in_flight=1, resend_s=1000.0)


def take_images(room) -> list:
    """Somebody takes all images; a list that grows by those of colour."""
    probe = room.probe()
    taken = {
        part: probe.collect_raw(
            CameraInfo if part == "camera_info" else Image, topic, profile_of(QosClass.FRAME)
        )
        for part, topic in TOPIC_OF_PART.items()
    }
    return taken["color"]


def test_a_scene_that_waits_is_shown_again_at_once_to_a_newcomer(ros_room, camera):
    seen = take_images(ros_room)
    assert ros_room.wait_for(lambda: seen)
    newcomer = take_images(ros_room)
    assert ros_room.wait_for(lambda: newcomer)
    assert stamp_of(newcomer[0].header) == stamp_of(seen[0].header)
    assert camera.health.counters["scenes_shown"] == 1
