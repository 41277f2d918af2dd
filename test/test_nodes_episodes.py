"""The real camera node on its own: actions over their topic, answers, and scenes of the effects."""

import pytest
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger

from ros_scenesense.messages.actions import Action, ActionResult, PlannedAction
from ros_scenesense.messages.scenes import Labels, Scene
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.frames import TOPIC_OF_PART
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode


@pytest.fixture
def camera(ros_room):
    return Camera(ros_room)


class Camera:
    """The node, which shows a scene only when asked, and a probe that looks at all its images."""

    def __init__(self, room):
        self.room = room
        self.node = room.add(
            SimulatedCameraNode, autostart=False, arrangement="spread", width=160, height=120
        )
        self.probe = room.probe()
        for part, topic in TOPIC_OF_PART.items():
            kind = CameraInfo if part == "camera_info" else Image
            self.probe.collect_raw(kind, topic, profile_of(QosClass.FRAME))
        self.scenes = self.probe.collect(Scene)
        self.labels = self.probe.collect(Labels)
        self.results = self.probe.collect(ActionResult)
        assert room.wait_for(lambda: self.probe.publisher(Action).get_subscription_count() > 0)

    def show_scene(self) -> Scene:
        client = self.probe.node.create_client(Trigger, "next_scene")
        assert self.room.wait_for(client.service_is_ready)
        before = len(self.scenes)
        answer = client.call_async(Trigger.Request())
        assert self.room.wait_for(answer.done)
        assert self.room.wait_for(lambda: len(self.scenes) > before, timeout_s=40.0)
        return self.scenes[-1]

    def act(self, scene: Scene, id: str, planned: PlannedAction) -> ActionResult:
        before = len(self.results)
        action = Action(
            stamp=scene.stamp,
            scene_id=scene.scene_id,
            id=id,
            episode_id="tidy up",
            step=scene.step,
            action=planned,
        )
        self.probe.say(action)
        assert self.room.wait_for(lambda: len(self.results) > before)
        return self.results[-1]

    def effect(self, scene: Scene) -> Scene:
        """The scene that was shown after this one."""
        number = self.scenes.index(scene) + 1
        assert self.room.wait_for(lambda: len(self.scenes) > number)
        return self.scenes[number]


def test_actions_over_ros_are_answered_once_and_their_effects_shown(camera):
    first = camera.show_scene()
    held, other = (known.name for known in first.objects[:2])
    pickup = PlannedAction(kind="pickup", object=held)
    result = camera.act(first, "1", pickup)
    assert (result.outcome, result.scene_id, result.reason) == ("executed", first.scene_id, "")
    second = camera.effect(first)
    assert (second.episode_id, second.step, second.in_hand) == ("tidy up", 1, held)
    assert held not in {known.name for known in second.objects}

    assert camera.act(first, "1", pickup) == result
    refused = camera.act(second, "2", PlannedAction(kind="pickup", object=other))
    assert (refused.outcome, refused.reason) == ("refused", f"the hand holds {held}")

    putdown = PlannedAction(kind="putdown", object=held, location="table")
    assert camera.act(second, "3", putdown).outcome == "executed"
    third = camera.effect(second)
    assert (third.step, third.in_hand) == (2, None)
    assert {known.name for known in third.objects} == {known.name for known in first.objects}
    assert camera.room.wait_for(lambda: camera.labels[-1].scene_id == third.scene_id)
    assert {label.name for label in camera.labels[-1].objects} == {
        known.name for known in third.objects
    }
