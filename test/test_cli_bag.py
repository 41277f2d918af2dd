"""`scenesense bag` as a user calls it: record, info, repair, play."""

import contextlib
import os
import shutil
import signal
import sqlite3
import subprocess
import sys

import pytest
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from ros_scenesense.bags.definitions import bag_topic
from ros_scenesense.bags.reading import describe
from ros_scenesense.bags.writing import BagFormat, BagWriter
from ros_scenesense.cli.main import main as command


@pytest.fixture
def bag(tmp_path):
    writer = BagWriter(tmp_path / "bag", BagFormat())
    writer.add_topic(bag_topic("/words", "std_msgs/msg/String", [QoSProfile(depth=1)]))
    for number in range(3):
        writer.write("/words", 10**18 + number * 10**9, b"\0\1\0\0\2\0\0\0a\0")
    writer.flush()
    shutil.copytree(writer.folder, tmp_path / "torn")
    writer.close({"dropped": '{"/words": 7}', "ended": "the disk was full"})
    return writer.folder


def test_info_tells_what_a_bag_holds(bag, capsys):
    assert command(["bag", "info", str(bag)]) == 0
    said = capsys.readouterr().out
    for words in ("/words", "3 messages", "2.0 s", "dropped   7 on /words", "the disk was full"):
        assert words in said, words


def test_a_torn_bag_is_named_and_repaired(bag, capsys):
    torn = bag.parent / "torn"
    assert command(["bag", "info", str(torn)]) == 1
    assert f"scenesense bag repair {torn}" in capsys.readouterr().err
    assert command(["bag", "repair", str(torn)]) == 0
    assert "is whole again: 3 messages; 1 files were cut off" in capsys.readouterr().out
    assert command(["bag", "repair", str(torn)]) == 0
    assert f"{torn} is whole\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--rate", "0"], 2, "--rate is 0, must be more than 0"),
        (["--rate", "nan"], 2, "--rate is nan"),
        (["--loop", "-1"], 2, "--loop is -1"),
        (["--clock", "-5"], 2, "--clock is -5 Hz"),
        (["--lockstep"], 2, "only with --inputs"),
        (["--inputs", "--loop", "2"], 2, "decides each scene once"),
        (["--domain-id", "400"], 2, "from 0 to 232"),
        (["--topic", "none"], 1, "has no message on the topics"),
    ],
)
def test_what_cannot_be_played_is_one_line(bag, capfd, words, code, said):
    assert command(["bag", "play", str(bag), *words]) == code
    error = capfd.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def committed(folder):
    """How many messages of the bag in a folder are on disk."""
    for file in folder.rglob("*.db3"):
        with (
            contextlib.suppress(sqlite3.OperationalError),
            contextlib.closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as opened,
        ):
            return opened.execute("SELECT count(*) FROM messages").fetchone()[0]
    return 0


def test_a_bag_is_recorded_and_played(ros_room, tmp_path):
    def bag_command(*words):
        return subprocess.Popen(
            [sys.executable, "-m", "ros_scenesense.cli.main", "bag", *words],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )

    node = ros_room.probe().node
    publisher = node.create_publisher(String, "words", 10)
    recording = bag_command("record", "words", "--out", str(tmp_path), "--storage", "sqlite3")
    try:
        assert ros_room.wait_for(lambda: publisher.get_subscription_count() > 0, 60.0)
        publisher.publish(String(data="spoken"))
        assert ros_room.wait_for(lambda: committed(tmp_path) == 1)
        recording.send_signal(signal.SIGINT)
        said, _ = recording.communicate(timeout=60.0)
    finally:
        recording.kill()
    (bag,) = tmp_path.glob("bag-*")
    assert recording.returncode == 0
    assert f"{bag}: 1 messages" in said
    assert describe(bag).storage == "sqlite3"
    node.destroy_publisher(publisher)
    heard = []
    node.create_subscription(String, "words", heard.append, 10)
    playing = bag_command("play", str(bag))
    try:
        assert ros_room.wait_for(lambda: heard, 60.0)
        assert heard[0].data == "spoken"
        assert playing.communicate(timeout=60.0)[0] == "1 messages played\n"
    finally:
        playing.kill()
