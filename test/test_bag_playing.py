"""Bags are played byte for byte in their time, and inputs scene by scene; without a graph."""

import pytest
from rclpy.qos import QoSProfile

from ros_scenesense.bags.definitions import bag_topic
from ros_scenesense.bags.inputs import Inputs, text_of
from ros_scenesense.bags.lockstep import Comparison
from ros_scenesense.bags.playing import Player, PlayOptions
from ros_scenesense.bags.reading import describe
from ros_scenesense.bags.writing import BagFormat, BagWriter
from ros_scenesense.errors import BagError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.reasoning import Belief, Beliefs, ObjectBelief, StructureBelief

SECOND = 1_000_000_000
BEGIN = 1_700_000_000 * SECOND
CLOCK = "/clock"


class World:
    """Time that passes only while somebody waits, and publishers that note when they were used."""

    def __init__(self):
        self.now_s = 50.0
        self.published = []
        self.timers = []

    def monotonic(self):
        return self.now_s

    # What an executor does

    def spin_once(self, timeout_sec):
        self.now_s += timeout_sec
        for callback in self.timers:
            callback()

    # What a node does

    def create_timer(self, _period_s, callback, **_options):
        self.timers.append(callback)

    def create_publisher(self, _kind, topic, profile):
        return Publisher(self, topic, profile)


class Publisher:
    def __init__(self, world, topic, profile):
        self.world, self.topic, self.profile = world, topic, profile

    def publish(self, message):
        self.world.published.append((self.topic, round(self.world.now_s - 50.0, 3), message))

    def get_subscription_count(self):
        return 1

    def wait_for_all_acked(self, _timeout):
        return True


@pytest.fixture
def bag(tmp_path):
    writer = BagWriter(tmp_path / "bag", BagFormat())
    for name, kind in (("/a", "std_msgs/msg/String"), ("/b", "std_msgs/msg/Float32")):
        writer.add_topic(bag_topic(name, kind, [QoSProfile(depth=1)]))
    for number in range(6):
        topic = "/a" if number % 2 else "/b"
        writer.write(topic, BEGIN + number * SECOND // 2, bytes([0, 1, 0, 0, number]))
    writer.close({})
    return describe(writer.folder)


def play(bag, topics=("/a", "/b"), **options):
    world = World()
    player = Player(world, world, bag, topics, PlayOptions(**options), monotonic=world.monotonic)
    player.play()
    return player, world.published


@pytest.mark.parametrize("rate", [1.0, 4.0])
def test_messages_keep_their_bytes_order_and_distances(bag, rate):
    player, published = play(bag, rate=rate)
    assert [data for _, _, data in published] == [bytes([0, 1, 0, 0, n]) for n in range(6)]
    assert [at for _, at, _ in published] == [round(n / 2 / rate, 3) for n in range(6)]
    assert player.published == 6


def test_only_the_chosen_topics_are_played(bag):
    _, published = play(bag, topics=("/a", "/no_such"))
    assert {topic for topic, _, _ in published} == {"/a"}
    assert [at for _, at, _ in published] == [0.0, 1.0, 2.0]
    with pytest.raises(BagError, match="no message"):
        play(bag, topics=("/no_such",))


def test_it_begins_again_as_often_as_asked(bag):
    _, published = play(bag, loops=3)
    assert [data for _, _, data in published] == [bytes([0, 1, 0, 0, n]) for n in range(6)] * 3


def test_it_ends_when_asked(bag):
    world = World()
    player = Player(
        world,
        world,
        bag,
        ("/a", "/b"),
        PlayOptions(loops=0),
        stopped=lambda: len(world.published) >= 9,
        monotonic=world.monotonic,
    )
    player.play()
    assert len(world.published) == 9


def test_the_clock_tells_the_time_of_the_bag(bag):
    _, published = play(bag, rate=2.0, clock_hz=100.0)
    times = [
        (at, message.clock.sec * SECOND + message.clock.nanosec)
        for topic, at, message in published
        if topic == CLOCK
    ]
    assert times[0][1] == BEGIN
    assert len(times) > 20
    for at, told_ns in times:
        assert told_ns == pytest.approx(BEGIN + at * 2.0 * SECOND, abs=2_000_000)
    first = next(index for index, each in enumerate(published) if each[0] != CLOCK)
    assert CLOCK in {topic for topic, _, _ in published[:first]}


def string(text):
    data = text.encode() + b"\0"
    return bytes([0, 1, 0, 0]) + len(data).to_bytes(4, "little") + data


def stamped(stamp_s):
    return bytes([0, 1, 0, 0]) + stamp_s.to_bytes(4, "little") + bytes(40)


def scene_text(stamp_s, scene_id):
    labels = f'"stamp": {{"sec": {stamp_s}, "nanosec": 0}}, "scene_id": "{scene_id}"'
    return f'{{"schema": "labels/1", {labels}, "use": "train", "objects": [], "structures": []}}'


def test_inputs_are_put_together_by_their_stamps():
    inputs = Inputs("/room")
    color, labels, feedback = (
        f"/room/{name}" for name in ("camera/color/image_raw", "labels", "feedback")
    )
    assert {color, labels, feedback, "/room/scene"} <= inputs.topics
    assert "/room/estimates" not in inputs.topics
    recorded = [
        (color, 0, stamped(7)),
        (labels, 1, string(scene_text(7, "x-0007"))),
        (color, 2, stamped(8)),
        (color, 3, stamped(7)),
        (feedback, 4, string("{}")),
        (labels, 5, string(scene_text(8, "x-0008"))),
        (labels, 6, string("nonsense")),
        (color, 10 * SECOND, stamped(7)),
    ]
    units = list(inputs.by_scene(recorded))
    assert [[at for _, at, _ in unit.messages] for unit in units] == [
        [0, 1, 3],
        [2, 5],
        [4],
        [6],
        [10 * SECOND],
    ]
    assert [unit.scene_id for unit in units] == ["x-0007", "x-0008", None, None, None]


def beliefs(value, revision="r1"):
    stable = Belief(status="by_default", value=value)
    occluded = Belief(status="undecided")
    return Beliefs(
        stamp=Stamp(7, 0),
        scene_id="x-0007",
        objects=[ObjectBelief(name="duck", stable=stable, occluded=occluded)],
        structures=[StructureBelief(members=["duck"], stable=stable)],
        derived=[],
        knowledge_revision=revision,
        trust_revision=0,
    )


def test_decisions_are_compared_with_the_recorded_ones_and_what_they_rest_on():
    comparison = Comparison()
    comparison.judge("same", [beliefs(True)], [beliefs(True)])
    comparison.judge("new", [None], [beliefs(True)])
    comparison.judge("knows more", [beliefs(True)], [beliefs(True, "r2")])
    comparison.judge("other", [beliefs(True)], [beliefs(False)])
    assert comparison.same == ["same", "knows more"]
    assert comparison.new == ["new"]
    assert comparison.other_revisions == ["knows more"]
    words = "stable(duck): recorded yes (by_default), now no (by_default)"
    assert comparison.different == {"other": words}


def test_text_of_a_serialised_string():
    assert text_of(string("größe")) == "größe"
    assert text_of(string("")) == ""
