"""Goals over ROS: real nodes, and a camera that shows scenes by itself until there is a goal."""

import os
import subprocess
import sys

from ros_scenesense.messages.actions import Action, ActionResult, Goal, Plan, Transition
from ros_scenesense.messages.scenes import Labels, Scene
from ros_scenesense.nodes.attention import AttentionNode
from ros_scenesense.nodes.grounding import GroundingNode
from ros_scenesense.nodes.grounding_control import GroundingControlNode
from ros_scenesense.nodes.reasoner import ReasonerNode
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode
from ros_scenesense.resources import resource


class Graph:
    """The nodes, and a probe that listens to all that is said about a goal."""

    def __init__(self, room, reasoner=None, **camera):
        self.room = room
        self.reasoner = room.add(ReasonerNode, **(reasoner or {}))
        room.add(AttentionNode, network="none")
        room.add(GroundingControlNode)
        room.add(GroundingNode, image_timeout_s=0.5)
        self.probe = room.probe()
        self.scenes = self.probe.collect(Scene)
        self.labels = self.probe.collect(Labels)
        self.plans = self.probe.collect(Plan)
        self.actions = self.probe.collect(Action)
        self.results = self.probe.collect(ActionResult)
        self.transitions = self.probe.collect(Transition)
        self.camera = room.add(SimulatedCameraNode, width=240, height=180, **camera)
        assert room.wait_for(lambda: self.probe.publisher(Goal).get_subscription_count() == 2)

    def want(self, goal: str) -> Plan:
        """The last word on a goal."""
        before = len(self.plans)
        self.probe.say(Goal(goal=goal))
        assert self.room.wait_for(
            lambda: len(self.plans) > before and self.plans[-1].outcome != "found", timeout_s=90.0
        )
        return self.plans[-1]

    def structures(self, scene_id: str) -> list[list[str]]:
        """The true structures of a scene, by the simulation's labels."""
        assert self.room.wait_for(lambda: any(each.scene_id == scene_id for each in self.labels))
        (labels,) = {
            each.scene_id: each for each in self.labels if each.scene_id == scene_id
        }.values()
        return [each.members for each in labels.structures]


def test_a_goal_holds_the_camera_and_is_reached_in_the_simulated_world(ros_room):
    graph = Graph(ros_room, arrangement="towers", seed=3)
    assert ros_room.wait_for(lambda: len(graph.scenes) >= 2, timeout_s=60.0)
    refused = graph.want("on(red_cylinder, a). bad(")
    assert (refused.outcome, "goal:1" in refused.reason) == ("refused", True)
    before = len(graph.scenes)
    assert ros_room.wait_for(lambda: len(graph.scenes) > before, timeout_s=30.0)
    last = graph.want("all on(X, table)")
    assert (last.outcome, last.reason) == ("reached", "")
    assert len(graph.transitions) >= 2
    episode = [each for each in graph.scenes if each.episode_id == last.id]
    assert [each.step for each in episode] == list(range(1, len(episode) + 1))
    assert episode[-1].scene_id == last.scene_id
    # The simulation itself says that every object stands alone.
    assert all(len(members) == 1 for members in graph.structures(last.scene_id))
    # Meanwhile the camera showed nothing else; afterwards it goes on by itself.
    begun = next(i for i, each in enumerate(graph.scenes) if each.episode_id == last.id)
    assert ros_room.wait_for(lambda: graph.scenes[-1].episode_id is None, timeout_s=30.0)
    shown = [each.episode_id for each in graph.scenes[begun:]]
    assert shown == [last.id] * len(episode) + [None] * (len(shown) - len(episode))


def test_the_papers_first_trace_in_the_simulated_world(ros_room):
    withheld = {"withheld": "s1,s2,s3,o1,o2,o3"}
    trace = str(resource("config", "scenes/trace_1.yaml"))
    graph = Graph(ros_room, withheld, scene_files=trace)
    assert ros_room.wait_for(lambda: graph.scenes, timeout_s=60.0)
    process = subprocess.Popen(
        [sys.executable, "-m", "ros_scenesense.cli.main", "goal", "on(red_cylinder, white_cube)"],
        stdout=subprocess.PIPE,
        text=True,
        env=dict(os.environ),
    )
    assert ros_room.wait_for(lambda: process.poll() is not None, timeout_s=120.0)
    output, _ = process.communicate()
    assert (process.returncode, output.splitlines()[-1].startswith("reached in")) == (0, True)
    assert output.count("\n  putdown(red_cylinder, white_cube)") == 2
    first, again, last = graph.plans
    assert (len(first.actions), len(again.actions)) == (6, 2)
    assert first.actions[3].location == "yellow_duck"
    assert again.reason.endswith("on(white_cube, table) was seen: fall(white_cube)")
    assert ["red_cylinder", "white_cube"] in graph.structures(last.scene_id)
