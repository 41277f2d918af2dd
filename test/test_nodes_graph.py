"""The four real nodes in one process: scenes are decided, whatever else comes on the topics."""

import msgspec
import numpy as np
import pytest
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.grounding import Groundings, Objects, Relations
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.reasoning import Beliefs, Explanation, Knowledge, Query, Verdicts
from ros_scenesense.messages.scenes import Labels, Scene
from ros_scenesense.messages.topics import TOPICS, QosClass
from ros_scenesense.nodes.attention import AttentionNode
from ros_scenesense.nodes.conversions import image_message, instances_of, stamp_of
from ros_scenesense.nodes.frames import TOPIC_OF_PART
from ros_scenesense.nodes.grounding import GroundingNode
from ros_scenesense.nodes.grounding_control import GroundingControlNode
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.reasoner import ReasonerNode
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode

HOSTILE_TEXTS = [
    "",
    "{",
    "[]",
    "null",
    "[" * 5000,
    '"\\ud800"',
    "\u0000",
    '{"schema": "bogus/1"}',
    '{"schema": "scene/1", "stamp": {"sec": NaN, "nanosec": 0}}',
    '{"schema": "scene/1", "stamp": {"sec": -1, "nanosec": 0}, "scene_id": ""}',
]


class Graph:
    """The nodes, which show a scene only when asked, and a probe that listens to all they say."""

    def __init__(self, room):
        self.room = room
        # Built from the end of the graph on, so that the camera finds its audience.
        self.attention = room.add(AttentionNode, network="none")
        self.reasoner = room.add(ReasonerNode)
        self.control = room.add(GroundingControlNode)
        self.grounding = room.add(GroundingNode, image_timeout_s=0.3)
        self.camera = room.add(SimulatedCameraNode, autostart=False, arrangement="towers")
        self.nodes = {
            node.get_name(): node
            for node in (
                self.attention,
                self.reasoner,
                self.control,
                self.grounding,
                self.camera,
            )
        }
        self.probe = room.probe()
        self.estimates = self.probe.collect(Estimates)
        self.heartbeats = self.probe.collect(Heartbeat)
        self.next_scene = self.probe.node.create_client(Trigger, "next_scene")
        self.reset = self.probe.node.create_client(Trigger, "reset")
        assert room.wait_for(self.next_scene.service_is_ready)

    def call(self, client) -> Trigger.Response:
        answer = client.call_async(Trigger.Request())
        assert self.room.wait_for(answer.done)
        return answer.result()

    def show_scene(self) -> Estimates:
        """Asks for a scene; its estimates."""
        before = len(self.estimates)
        assert self.call(self.next_scene).success
        assert self.room.wait_for(lambda: len(self.estimates) > before, timeout_s=40.0)
        return self.estimates[-1]

    def wait_for_counter(self, node: str, counter: str, least: int) -> bool:
        """Waits until a heartbeat tells of it."""
        return self.room.wait_for(
            lambda: any(
                beat.node == node and beat.counters.get(counter, 0) >= least
                for beat in self.heartbeats
            )
        )


@pytest.fixture(scope="module")
def graph(shared_ros_room):
    return Graph(shared_ros_room)


def test_scenes_get_estimates_with_all_that_belongs_to_them(graph):
    kinds = (Scene, Labels, Objects, Groundings, Relations, Verdicts)
    collected = {kind: graph.probe.collect(kind) for kind in kinds}
    knowledge = graph.probe.collect(Knowledge)
    estimates = [graph.show_scene() for _ in range(3)]
    scene_ids = [each.scene_id for each in estimates]
    assert len(set(scene_ids)) == 3
    for kind, messages in collected.items():
        assert graph.room.wait_for(lambda messages=messages: len(messages) >= 3), kind
        by_id = {message.scene_id: message for message in messages}
        for each in estimates:
            assert by_id[each.scene_id].stamp == each.stamp
    scene = collected[Scene][-1]
    assert {one.name for one in estimates[-1].objects} == {one.name for one in scene.objects}
    assert graph.room.wait_for(lambda: knowledge)
    assert estimates[-1].knowledge_revision == knowledge[0].revision


def test_a_query_about_the_newest_scene_is_explained(graph):
    estimates = graph.show_scene()
    explanations = graph.probe.collect(Explanation)
    decided = next(each for each in estimates.objects if each.stable.value is not None)
    sign = "" if decided.stable.value else "-"
    publisher = graph.probe.publisher(Query)
    assert graph.room.wait_for(lambda: publisher.get_subscription_count() > 0)
    graph.probe.say(Query(id="why-1", literal=f"{sign}stable({decided.name})"))
    assert graph.room.wait_for(lambda: explanations)
    answer = explanations[0]
    assert (answer.id, answer.scene_id, answer.holds) == ("why-1", estimates.scene_id, True)
    assert answer.steps[0].axiom


def test_pictures_for_people_are_published(graph):
    frame_profile = profile_of(QosClass.FRAME)
    segmentations = graph.probe.collect_raw(Image, "segmentation", frame_profile)
    clouds = graph.probe.collect_raw(PointCloud2, "cloud", frame_profile)
    markers = graph.probe.collect_raw(MarkerArray, "markers", profile_of(QosClass.STATE))
    assert graph.room.wait_for(
        lambda: (
            graph.grounding.stage.cloud_wanted
            and graph.probe.node.count_publishers("/scenesense/segmentation")
        )
    )
    estimates = graph.show_scene()
    stamp_ns = estimates.stamp.nanoseconds

    def of_scene(messages):
        return [message for message in messages if stamp_of(message.header) == stamp_ns]

    assert graph.room.wait_for(lambda: of_scene(segmentations) and of_scene(clouds))
    assert instances_of(of_scene(segmentations)[0]).max() >= len(estimates.objects)
    assert of_scene(clouds)[0].width > 100
    assert graph.room.wait_for(
        lambda: any(stamp_of(array.markers[0].header) == stamp_ns for array in markers)
    )


JSON_INPUTS = [
    ("simulated_camera", Estimates),
    ("grounding", Scene),
    ("grounding_control", Groundings),
    ("reasoner", Scene),
    ("reasoner", Relations),
    ("reasoner", Objects),
    ("reasoner", Labels),
    ("attention", Beliefs),
    ("attention", Verdicts),
]


@pytest.mark.parametrize(("node", "message"), JSON_INPUTS)
def test_hostile_json_is_counted_and_the_next_scene_decided(graph, node, message):
    texts = [*HOSTILE_TEXTS, "x" * (TOPICS[message].limit + 1)]
    counter = f"bad_{TOPICS[message].name}"
    before = graph.nodes[node].health.counters[counter]
    publisher = graph.probe.publisher(message)
    assert graph.room.wait_for(lambda: publisher.get_subscription_count() > 0)
    for text in texts:
        graph.probe.say_text(message, text)
    assert graph.wait_for_counter(node, counter, before + len(texts))
    assert graph.show_scene().objects


def test_valid_json_out_of_order_and_twice_is_ignored(graph):
    estimates = graph.show_scene()
    stranger = msgspec.structs.replace(estimates, scene_id="nobody-0007")
    for message in (stranger, estimates, estimates):
        graph.probe.say(message)
    assert graph.wait_for_counter("simulated_camera", "estimates_not_awaited", 3)
    assert graph.show_scene().objects


def pixels(height=240, width=320, dtype=np.uint16):
    return np.zeros((height, width), dtype)


@pytest.mark.parametrize(
    ("part", "image", "encoding", "kind"),
    [
        ("color", np.zeros((240, 320, 3), np.uint8), "yuv422", "bad_color"),
        ("depth", pixels(dtype=np.float32), "rgb8", "bad_depth"),
        ("depth", None, "32FC1", "bad_depth"),
        ("instances", pixels(height=10), "16UC1", "incomplete_frame"),
    ],
)
def test_wrong_images_are_counted_and_the_next_scene_decided(graph, part, image, encoding, kind):
    before = graph.grounding.health.counters[kind]
    publisher = graph.probe.node.create_publisher(
        Image, TOPIC_OF_PART[part], profile_of(QosClass.FRAME)
    )
    assert graph.room.wait_for(lambda: publisher.get_subscription_count() > 0)
    header = Header(stamp=graph.probe.node.get_clock().now().to_msg(), frame_id="camera")
    empty = Image(header=header, encoding=encoding)
    publisher.publish(empty if image is None else image_message(header, image, encoding))
    assert graph.wait_for_counter("grounding", kind, before + 1)
    assert graph.show_scene().objects
    graph.probe.node.destroy_publisher(publisher)


def test_a_service_that_fails_says_so(graph, monkeypatch):
    monkeypatch.setattr(graph.camera.stage, "_begin", lambda _session: 1 / 0)
    answer = graph.call(graph.reset)
    assert (answer.success, answer.message) == (False, "failed: see the node's log")
    monkeypatch.undo()
    assert graph.show_scene().objects


def test_reset_begins_a_new_session(graph):
    old = graph.show_scene().scene_id
    assert graph.call(graph.reset).success
    new = graph.show_scene().scene_id
    assert new.rpartition("-")[0] != old.rpartition("-")[0]
    assert int(new.rpartition("-")[2]) == 0
