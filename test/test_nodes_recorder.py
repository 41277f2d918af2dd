"""The recorder as a node and as a process: what it hears, how it is told, what a kill leaves."""

import contextlib
import os
import signal
import sqlite3
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from learning_samples import scenes
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import Image
from std_msgs.msg import Float32, Header, String
from std_srvs.srv import Trigger

from ros_scenesense.bags.mcap_scan import scan
from ros_scenesense.bags.repair import repair
from ros_scenesense.bags.writing import read_metadata
from ros_scenesense.errors import BagError
from ros_scenesense.messages.grounding import Objects
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.nodes.grounding import GroundingNode
from ros_scenesense.nodes.recorder import RecorderNode
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode
from ros_scenesense.nodes.topic_watch import TopicChoice, patterns_of

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def recorded(bag: Path) -> dict[str, list[bytes]]:
    """The messages of a bag by topic, in order."""
    found: dict[str, list[bytes]] = {}
    with Reader(bag) as reader:
        for each, _, data in reader.messages():
            found.setdefault(each.topic, []).append(data)
    return found


class Room:
    """A recorder and a probe that talks, with services to begin and to end."""

    def __init__(self, room, folder, **parameters):
        self.room, self.folder = room, folder
        self.probe = room.probe()
        self.recorder = room.add(RecorderNode, bag_dir=str(folder), **parameters)
        self.services = {
            name: self.probe.node.create_client(Trigger, f"recorder/{name}")
            for name in ("start", "stop")
        }
        for client in self.services.values():
            assert room.wait_for(client.service_is_ready)

    def call(self, name):
        answer = self.services[name].call_async(Trigger.Request())
        assert self.room.wait_for(answer.done)
        return answer.result()

    def publish(self, publisher, message):
        """Publishes once the recorder listens."""
        assert self.room.wait_for(lambda: publisher.get_subscription_count() > 0)
        publisher.publish(message)

    def wait_for_messages(self, topic, count):
        """Waits until so many messages are in the bag."""
        recording = self.recorder.stage._recording
        assert self.room.wait_for(lambda: recording.counts.by_topic.get(topic, 0) >= count), (
            recording.counts.by_topic
        )


def test_all_topics_are_recorded_byte_for_byte(ros_room, tmp_path):
    talker = ros_room.add(Node, "talker")
    publishers = {
        "/elsewhere/latched": (
            String,
            talker.create_publisher(String, "/elsewhere/latched", LATCHED),
        ),
        "/elsewhere/hasty": (
            Float32,
            talker.create_publisher(Float32, "/elsewhere/hasty", BEST_EFFORT),
        ),
    }
    # Before anybody listens: who comes later gets it for all that.
    publishers["/elsewhere/latched"][1].publish(String(data="kept"))
    room = Room(ros_room, tmp_path)
    said = list(scenes(1))
    for message in said:
        publisher = room.probe.publisher(type(message))
        assert ros_room.wait_for(lambda publisher=publisher: publisher.get_subscription_count() > 0)
        room.probe.say(message)
    hasty = publishers["/elsewhere/hasty"][1]
    room.publish(hasty, Float32(data=1.5))
    # A name of this length needs no padding, whose bytes are arbitrary.
    header = Header(frame_id="cam")
    image = Image(header=header, height=1, width=2, encoding="mono8", step=2, data=b"ab")
    late = talker.create_publisher(Image, "/elsewhere/late", 5)
    room.publish(late, image)
    for topic in ("/elsewhere/latched", "/elsewhere/hasty", "/elsewhere/late"):
        room.wait_for_messages(topic, 1)
    room.wait_for_messages("/scenesense/objects", 1)
    answer = room.call("stop")
    assert answer.success, answer.message
    (bag,) = tmp_path.iterdir()
    assert answer.message.startswith(str(bag))
    assert answer.message.endswith("0 dropped")
    found = recorded(bag)
    assert found["/elsewhere/latched"] == [serialize_message(String(data="kept"))]
    assert found["/elsewhere/hasty"] == [serialize_message(Float32(data=1.5))]
    assert found["/elsewhere/late"] == [serialize_message(image)]
    objects = next(each for each in said if isinstance(each, Objects))
    assert objects.scene_id.encode() in found["/scenesense/objects"][0]
    with Reader(bag) as reader:
        qos = {each.topic: each.ext.offered_qos_profiles[0] for each in reader.connections}
    assert qos["/elsewhere/latched"].durability.name == "TRANSIENT_LOCAL"
    assert qos["/elsewhere/hasty"].reliability.name == "BEST_EFFORT"


def test_recording_begins_and_ends_on_request(ros_room, tmp_path):
    room = Room(ros_room, tmp_path, autostart=False, topics="words/*", leave_out="words/secret")
    assert not room.call("stop").success
    assert list(tmp_path.iterdir()) == []
    words = room.probe.node.create_publisher(String, "words/one", 10)
    secret = room.probe.node.create_publisher(String, "words/secret", 10)
    bags = []
    for number in (1, 2):
        answer = room.call("start")
        assert answer.success
        bags.append(Path(answer.message))
        assert not room.call("start").success
        room.publish(words, String(data=f"word {number}"))
        secret.publish(String(data="nobody hears this"))
        room.wait_for_messages("/scenesense/words/one", 1)
        assert room.call("stop").success
    for number, bag in enumerate(bags, start=1):
        assert recorded(bag) == {
            "/scenesense/words/one": [serialize_message(String(data=f"word {number}"))]
        }


def test_what_is_dropped_is_in_the_diagnostics_and_the_last_words(ros_room, tmp_path):
    room = Room(ros_room, tmp_path, queue_mb=1, topics="big")
    beats = room.probe.collect(Heartbeat)
    big = room.probe.node.create_publisher(String, "big", 10)
    room.publish(big, String(data="x" * 2_000_000))
    assert ros_room.wait_for(
        lambda: any(b.node == "recorder" and b.counters.get("dropped") == 1 for b in beats)
    )
    answer = room.call("stop")
    assert answer.message.endswith(": 0 messages, 0.0 MB, 1 dropped")
    assert "is not recorded" in room.recorder.health.last_problem


def test_a_full_bag_is_closed_and_that_is_said(ros_room, tmp_path):
    room = Room(ros_room, tmp_path, bag_mb=1, topics="big")
    beats = room.probe.collect(Heartbeat)
    big = room.probe.node.create_publisher(String, "big", 10)
    room.publish(big, String(data="x" * 1_100_000))
    assert ros_room.wait_for(
        lambda: any(
            beat.node == "recorder" and beat.counters.get("recording_ended") == 1 for beat in beats
        )
    )
    assert "is full" in room.recorder.health.last_problem
    (bag,) = tmp_path.iterdir()
    assert read_metadata(bag)["message_count"] == 1
    assert room.call("start").success


def test_a_bag_carries_the_state_as_it_was_at_its_start(ros_room, tmp_path):
    state = tmp_path / "state"
    camera = ros_room.add(SimulatedCameraNode, autostart=False, state_dir=str(state))
    room = Room(ros_room, tmp_path / "bags", state_dir=str(state), topics="nothing")
    assert room.call("stop").success
    (bag,) = (tmp_path / "bags").iterdir()
    with zipfile.ZipFile(bag / "state.zip") as archive:
        assert set(archive.namelist()) == {"manifest.json", "camera.db"}
    ros_room.remove(camera)


def test_a_recorder_is_nobodys_audience(ros_room, tmp_path):
    room = Room(ros_room, tmp_path, autostart=False)
    camera = ros_room.add(SimulatedCameraNode, scenes=1)
    frames = camera._frames.publishers["instances"]
    assert ros_room.wait_for(lambda: frames.get_subscription_count() == 1)
    beats = room.probe.collect(Heartbeat)
    assert ros_room.wait_for(lambda: sum(beat.node == "simulated_camera" for beat in beats) > 2)
    assert not camera.stage.audience
    ros_room.add(GroundingNode)
    assert ros_room.wait_for(lambda: camera.stage.audience)


def test_choice_of_topics():
    choice = TopicChoice("/room", patterns_of("timing/*, scene,/rosout"), patterns_of("timing/x/*"))
    assert [
        choice.takes(name)
        for name in (
            "/room/scene",
            "/room/scenes",
            "/room/timing/a/b",
            "/room/timing/x/b",
            "/rosout",
        )
    ] == [True, False, True, False, True]
    assert TopicChoice("/room").takes("/anything")


def safe(folder: Path) -> int:
    """How many messages of the bag in a folder outlive a kill."""
    for file in folder.rglob("*.mcap"):
        with contextlib.suppress(BagError):
            return sum(1 for _ in scan(file))
    for file in folder.rglob("*.db3"):
        with (
            contextlib.suppress(sqlite3.OperationalError),
            contextlib.closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as opened,
        ):
            return opened.execute("SELECT count(*) FROM messages").fetchone()[0]
    return 0


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_the_bag_of_a_killed_recorder_is_repaired(ros_room, tmp_path, storage):
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "ros_scenesense.nodes", "recorder", "--ros-args"),
            *("-r", "__ns:=/scenesense", "-p", f"bag_dir:={tmp_path}", "-p", f"storage:={storage}"),
            *("-p", "topics:=words,pages"),
        ],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    try:
        node = ros_room.probe().node
        deep = QoSProfile(depth=200)
        said = {
            topic: [String(data=f"{number} " * size) for number in range(100)]
            for topic, size in (("words", 1), ("pages", 30_000))
        }
        publishers = {topic: node.create_publisher(String, topic, deep) for topic in said}
        assert ros_room.wait_for(
            lambda: all(each.get_subscription_count() for each in publishers.values()), 60.0
        )
        for number in range(100):
            for topic, publisher in publishers.items():
                publisher.publish(said[topic][number])

        assert ros_room.wait_for(lambda: safe(tmp_path) >= 120)
        process.send_signal(signal.SIGKILL)
        process.wait()
        (bag,) = tmp_path.iterdir()
        assert not (bag / "metadata.yaml").exists()
        done = repair(bag)
    finally:
        process.kill()
    found = recorded(bag)
    assert sum(map(len, found.values())) == done.messages
    for topic, all_said in said.items():
        kept = [deserialize_message(data, String) for data in found[f"/scenesense/{topic}"]]
        assert len(kept) >= 50
        assert kept == all_said[: len(kept)]
    assert read_metadata(bag)["message_count"] == done.messages
