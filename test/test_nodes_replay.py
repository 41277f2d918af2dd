"""A session is recorded and its inputs are played to new nodes: they decide as the first ones did.

In the second graph there is no camera, and the time is that of the bag.
"""

import zipfile
from pathlib import Path

import pytest
from conftest import RosRoom
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from ros_scenesense.bags.inputs import Inputs
from ros_scenesense.bags.lockstep import Lockstep
from ros_scenesense.bags.playing import Player, PlayOptions
from ros_scenesense.bags.reading import describe
from ros_scenesense.messages.attention import Estimates, Rois
from ros_scenesense.messages.grounding import Groundings, Objects, Relations
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.reasoning import Beliefs, Verdicts
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.attention import AttentionNode
from ros_scenesense.nodes.conversions import stamp_of
from ros_scenesense.nodes.grounding import GroundingNode
from ros_scenesense.nodes.grounding_control import GroundingControlNode
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.reasoner import ReasonerNode
from ros_scenesense.nodes.recorder import RecorderNode
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode

SCENES = 3
OF_SCENES = (Objects, Groundings, Relations, Beliefs, Verdicts, Rois, Estimates)


def add_deciding_nodes(room: RosRoom, state: Path, **options: object) -> None:
    """All between the camera and the decisions; nothing is learned on the way."""
    room.add(AttentionNode, network="none", state_dir=str(state), **options)
    room.add(ReasonerNode, state_dir=str(state), withheld="o2,o3", **options)
    frozen = {"evidence_confidence": 1.0}
    room.add(GroundingControlNode, state_dir=str(state), **frozen, **options)
    room.add(GroundingNode, state_dir=str(state), **options)


def record(folder: Path) -> Path:
    """The bag of a session of a few scenes, one at a time."""
    room = RosRoom()
    try:
        state = folder / "state"
        recorder = room.add(RecorderNode, bag_dir=str(folder / "bags"), state_dir=str(state))
        add_deciding_nodes(room, state)
        estimates = room.probe().collect(Estimates)
        room.add(SimulatedCameraNode, scenes=SCENES, in_flight=1, seed=3, state_dir=str(state))
        assert room.wait_for(lambda: len(estimates) >= SCENES, timeout_s=90.0)
        recording = recorder.stage._recording
        for topic in ("estimates", "beliefs", "camera/color/image_raw"):
            name = f"/scenesense/{topic}"
            assert room.wait_for(
                lambda name=name: recording.counts.by_topic.get(name, 0) >= SCENES
            ), topic
    finally:
        room.close()
    (bag,) = (folder / "bags").iterdir()
    return bag


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return describe(record(tmp_path_factory.mktemp("session")))


def test_new_nodes_decide_as_the_recorded_ones_and_keep_the_stamps(bag, ros_room, tmp_path):
    room, state = ros_room, tmp_path / "state"
    with zipfile.ZipFile(bag.state) as archive:
        archive.extractall(state)
    add_deciding_nodes(room, state, use_sim_time=True)
    probe = room.probe()
    collected = {kind: probe.collect(kind) for kind in OF_SCENES}
    beats = probe.collect(Heartbeat)
    segmentations = probe.collect_raw(Image, "segmentation", profile_of(QosClass.FRAME))
    markers = probe.collect_raw(MarkerArray, "markers", profile_of(QosClass.STATE))
    inputs = Inputs("/scenesense")
    node = room.probe().node
    player = Player(node, room.executor, bag, inputs.topics, PlayOptions(clock_hz=50.0))
    comparison = Lockstep(node, player, bag, inputs, timeout_s=60.0).run()
    assert comparison.different == {}
    assert (comparison.undecided, comparison.new, comparison.other_revisions) == ([], [], [])
    assert len(comparison.same) == SCENES
    assert room.wait_for(lambda: len(collected[Estimates]) >= SCENES)
    stamps = {each.scene_id: each.stamp for each in collected[Estimates]}
    assert set(stamps) == set(comparison.same)
    for kind, messages in collected.items():
        assert room.wait_for(lambda messages=messages: len(messages) >= SCENES), kind
        assert {each.scene_id: each.stamp for each in messages} == stamps, kind
    assert all(
        bag.start_ns <= each.nanoseconds <= bag.start_ns + 1e9 * 90 for each in stamps.values()
    )
    in_ns = {stamp.nanoseconds for stamp in stamps.values()}
    assert room.wait_for(lambda: len(segmentations) >= SCENES and markers)
    assert {stamp_of(each.header) for each in segmentations} <= in_ns
    assert {stamp_of(array.markers[0].header) for array in markers} <= in_ns
    # The nodes live in the time of the bag, not in ours.
    end_ns = bag.start_ns + bag.duration_ns
    told = [beat.stamp.nanoseconds for beat in beats if beat.stamp.nanoseconds]
    assert told
    assert all(bag.start_ns <= each <= end_ns for each in told)
