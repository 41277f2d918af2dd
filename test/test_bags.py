"""Bags without ROS nodes: written, split, bounded, read by independent readers, and repaired."""

import shutil
import threading
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags.rosbag2 import Reader

from ros_scenesense.bags.definitions import bag_topic
from ros_scenesense.bags.recording import SMALL_BYTES, Recording, RecordingLimits
from ros_scenesense.bags.repair import repair
from ros_scenesense.bags.writing import BagFormat, BagWriter, read_metadata
from ros_scenesense.errors import BagError

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
WORDS = bag_topic("/words", "std_msgs/msg/String", [LATCHED])
PICTURES = bag_topic("/pictures", "sensor_msgs/msg/Image", [QoSProfile(depth=5)])
MB = 1_000_000
FORMATS = [BagFormat("mcap"), BagFormat("mcap", compressed=True), BagFormat("sqlite3")]


def messages(count: int, size: int = 300) -> list[tuple[str, int, bytes]]:
    """Topic, stamp and bytes of messages, no two alike."""
    topics = (WORDS.name, PICTURES.name)
    return [
        (topics[number % 2], 10**18 + number, number.to_bytes(4, "little") * (size // 4))
        for number in range(count)
    ]


def write(writer: BagWriter, written: list[tuple[str, int, bytes]]) -> None:
    for topic in (WORDS, PICTURES):
        writer.add_topic(topic)
    for each in written:
        writer.write(*each)


def content(bag: Path) -> list[tuple[str, int, bytes]]:
    with Reader(bag) as reader:
        return [(each.topic, stamp_ns, data) for each, stamp_ns, data in reader.messages()]


@pytest.mark.parametrize("format", FORMATS, ids=str)
def test_a_bag_holds_what_was_written(tmp_path, format):
    writer = BagWriter(tmp_path / "bag", format)
    write(writer, messages(50))
    writer.close({"who": "me"})
    assert content(writer.folder) == messages(50)
    information = read_metadata(writer.folder)
    assert (information["message_count"], information["custom_data"]) == (50, {"who": "me"})
    with Reader(writer.folder) as reader:
        topic = next(each for each in reader.connections if each.topic == WORDS.name)
        assert topic.digest == WORDS.digest
        assert topic.ext.offered_qos_profiles == list(WORDS.qos)
        assert "string data" in topic.msgdef.data


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_goes_on_in_new_files(tmp_path, storage):
    writer = BagWriter(tmp_path / "bag", BagFormat(storage, file_bytes=10_000))
    write(writer, messages(100, size=1000))
    writer.close({})
    files = read_metadata(writer.folder)["relative_file_paths"]
    assert len(files) == writer.counts.files == 10
    assert sorted(path.name for path in writer.folder.iterdir()) == sorted(
        [*files, "metadata.yaml"]
    )
    assert content(writer.folder) == messages(100, size=1000)


def test_a_bag_in_which_nothing_was_recorded_is_a_bag(tmp_path):
    writer = BagWriter(tmp_path / "bag", BagFormat())
    writer.add_topic(WORDS)
    writer.close({})
    assert content(writer.folder) == []
    assert repair(writer.folder) is None


def test_a_folder_that_exists_is_not_written_to(tmp_path):
    with pytest.raises(BagError, match="cannot be made"):
        BagWriter(tmp_path, BagFormat())


class SlowWriter(BagWriter):
    """Writes nothing before it may."""

    may = threading.Event()

    def write(self, *arguments):
        assert self.may.wait(20.0)
        super().write(*arguments)


def test_what_finds_no_place_is_dropped_counted_and_said(tmp_path, monkeypatch):
    monkeypatch.setattr("ros_scenesense.bags.recording.BagWriter", SlowWriter)
    recording = Recording(tmp_path / "bag", BagFormat(), RecordingLimits(queue_bytes=MB))
    for topic in (WORDS, PICTURES):
        recording.add_topic(topic)
    picture = bytes(2 * SMALL_BYTES)
    taken = [recording.put(PICTURES.name, number, picture) for number in range(20)]
    # A quarter of the queue is kept for what is small: decisions are not lost to images.
    assert taken == [True] * 5 + [False] * 15
    assert recording.put(WORDS.name, 99, b"decision")
    assert recording.waiting_bytes <= MB
    SlowWriter.may.set()
    assert recording.close(20.0)
    assert recording.dropped == {PICTURES.name: 15}
    assert read_metadata(recording.folder)["custom_data"]["dropped"] == '{"/pictures": 15}'
    assert len(content(recording.folder)) == 6


def test_a_full_bag_ends_the_recording(tmp_path):
    limits = RecordingLimits(queue_bytes=MB, bag_bytes=50_000)
    recording = Recording(tmp_path / "bag", BagFormat(), limits)
    recording.add_topic(WORDS)
    for number in range(400):
        recording.put(WORDS.name, number, bytes(300))
    assert recording.close(20.0)
    assert "is full" in recording.ended
    assert 50_000 <= recording.counts.payload_bytes < 50_300
    assert "is full" in read_metadata(recording.folder)["custom_data"]["ended"]
    assert not recording.put(WORDS.name, 1, b"more")


def test_a_full_disk_ends_the_recording(tmp_path):
    limits = RecordingLimits(queue_bytes=MB, free_bytes=2**60)
    recording = Recording(tmp_path / "bag", BagFormat(), limits)
    recording.add_topic(WORDS)
    for number in range(400):
        recording.put(WORDS.name, number, b"word")
    assert recording.close(20.0)
    assert "less than" in recording.ended
    assert content(recording.folder)


def test_a_disk_that_fails_ends_the_recording_and_keeps_what_is_there(tmp_path, monkeypatch):
    written = BagWriter.write

    def fail_at_the_third(writer, topic, stamp_ns, data):
        if stamp_ns == 2:
            raise OSError(28, "No space left on device")
        written(writer, topic, stamp_ns, data)

    monkeypatch.setattr(BagWriter, "write", fail_at_the_third)
    recording = Recording(tmp_path / "bag", BagFormat(), RecordingLimits(queue_bytes=MB))
    recording.add_topic(WORDS)
    for number in range(9):
        recording.put(WORDS.name, number, b"word")
    assert recording.close(20.0)
    assert "cannot be written: [Errno 28]" in recording.ended
    assert [stamp_ns for _, stamp_ns, _ in content(recording.folder)] == [0, 1]
    assert "No space left" in read_metadata(recording.folder)["custom_data"]["ended"]


def torn(folder: Path, format: BagFormat, written: list[tuple[str, int, bytes]]) -> Path:
    """A bag as a kill leaves it, the messages of which were flushed in four pieces."""
    writer = BagWriter(folder / "living", format)
    for start in range(0, len(written), len(written) // 4):
        write(writer, written[start : start + len(written) // 4])
        writer.flush()
    shutil.copytree(writer.folder, folder / "living_copy")
    writer.close({})
    return folder / "living_copy"


@pytest.mark.parametrize("format", FORMATS, ids=str)
def test_a_torn_bag_is_repaired_with_all_that_was_flushed(tmp_path, format):
    bag = torn(tmp_path, format, messages(40))
    with pytest.raises(BagError, match="bag repair"):
        read_metadata(bag)
    done = repair(bag)
    assert (done.sound + done.saved, done.messages) == (1, 40)
    assert content(bag) == messages(40)
    assert {path.suffix for path in bag.iterdir()} <= {".mcap", ".db3", ".yaml"}
    assert repair(bag) is None


def test_finished_files_of_a_torn_bag_stay_as_they_are(tmp_path):
    bag = torn(tmp_path, BagFormat("mcap", file_bytes=3000), messages(40))
    first = next(bag.glob("*_0.mcap"))
    before = first.read_bytes()
    done = repair(bag)
    assert (done.sound > 1, done.saved, done.messages) == (True, 1, 40)
    assert first.read_bytes() == before
    assert content(bag) == messages(40)
    with first.open("rb") as file:
        assert len(list(make_reader(file).iter_messages())) == 10


@pytest.mark.parametrize("compressed", [False, True])
def test_a_file_cut_off_anywhere_gives_its_complete_chunks(tmp_path, compressed):
    whole = torn(tmp_path, BagFormat("mcap", compressed=compressed), messages(40))
    data = next(whole.glob("*/*.mcap")).read_bytes()
    found = set()
    for number, length in enumerate([*range(8, len(data), len(data) // 12), len(data)]):
        bag = tmp_path / f"cut_{number}"
        (bag / "x_0").mkdir(parents=True)
        (bag / "x_0" / "x_0.mcap").write_bytes(data[:length])
        done = repair(bag)
        assert content(bag) == messages(40)[: done.messages]
        found.add(done.messages)
    assert found == {0, 10, 20, 30, 40}


@pytest.mark.parametrize("damage", ["nothing", "empty", "noise"])
def test_what_is_no_bag_is_refused(tmp_path, damage):
    bag = tmp_path / "bag"
    bag.mkdir()
    if damage != "nothing":
        (bag / "bag_0.mcap").write_bytes(b"" if damage == "empty" else b"noise" * 100)
    with pytest.raises(BagError):
        repair(bag)
