"""The attention node: the graph with it decides every object, trains on request, and shows it."""

import msgspec
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger

from ros_scenesense.messages.attention import Estimates, Examples, Rois
from ros_scenesense.messages.learning import JobProgress
from ros_scenesense.messages.reasoning import Beliefs
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.attention import AttentionNode
from ros_scenesense.nodes.conversions import color_of
from ros_scenesense.nodes.grounding import GroundingNode
from ros_scenesense.nodes.grounding_control import GroundingControlNode
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.reasoner import ReasonerNode
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode


def test_from_scenes_to_examples_to_a_network_that_decides_after_a_restart_too(ros_room, tmp_path):
    probe = ros_room.probe()
    estimates, rois = probe.collect(Estimates), probe.collect(Rois)
    examples, progress = probe.collect(Examples), probe.collect(JobProgress)
    beliefs = probe.collect(Beliefs)
    pictures: list[Image] = []
    probe.node.create_subscription(
        Image, "annotated_image", pictures.append, profile_of(QosClass.FRAME)
    )
    attention = ros_room.add(AttentionNode, network="none", iterations=2, state_dir=str(tmp_path))
    ros_room.add(ReasonerNode, withheld="s1,s2,s3,o1,o2,o3")
    ros_room.add(GroundingControlNode)
    ros_room.add(GroundingNode)
    ros_room.add(
        SimulatedCameraNode,
        mode="training",
        session="room",
        width=160,
        height=120,
        scenes=8,
        seed=5,
        in_flight=1,
    )
    train = probe.node.create_client(Trigger, "attention/train")
    assert ros_room.wait_for(lambda: len(examples) >= 6, timeout_s=90.0)
    assert ros_room.wait_for(train.service_is_ready)
    answer = train.call_async(Trigger.Request())
    assert ros_room.wait_for(answer.done)
    assert answer.result().success, answer.result().message
    assert ros_room.wait_for(lambda: progress and progress[-1].state == "done", timeout_s=90.0), (
        attention.health.last_problem
    )
    assert "is used from now on" in progress[-1].text
    assert ros_room.wait_for(lambda: len(estimates) == len(rois) == 8, timeout_s=60.0)
    assert ros_room.wait_for(lambda: len(pictures) > 0)
    assert color_of(pictures[-1]).shape[1] == 960
    decided = {each.scene_id: each for each in estimates}
    for item in beliefs:
        names = [each.name for each in decided[item.scene_id].objects]
        assert names == [each.name for each in item.objects]
    assert {"none", "network"} >= {
        each.occluded.source for item in estimates for each in item.objects
    }
    assert msgspec.structs.asdict(estimates[0])["network_revision"] is None

    ros_room.remove(attention)
    again = ros_room.add(AttentionNode, network="none", join_timeout_s=2.0, state_dir=str(tmp_path))
    more = probe.node.create_client(Trigger, "next_scene")
    assert ros_room.wait_for(more.service_is_ready)
    assert ros_room.wait_for(more.call_async(Trigger.Request()).done)
    # The old scenes come again with all but their images, which nobody shows.
    assert ros_room.wait_for(
        lambda: len(estimates) > 8 and again.health.counters["scenes_decided_before"] == 8,
        timeout_s=60.0,
    ), again.health.counters
    assert len({each.scene_id for each in estimates}) == len(estimates) == 9
    assert estimates[-1].network_revision == progress[-1].job_id
