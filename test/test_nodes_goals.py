"""Goals over ROS: real nodes, and a camera that shows scenes by itself until there is a goal."""

import itertools
import os
import subprocess
import sys

import pytest
from learning_samples import scenes
from std_srvs.srv import Trigger

from ros_scenesense.messages.actions import (
    Action,
    ActionResult,
    Goal,
    Plan,
    PlannedAction,
    Transition,
)
from ros_scenesense.messages.learning import Axioms
from ros_scenesense.messages.reasoning import Beliefs, Knowledge
from ros_scenesense.messages.scenes import Labels, Scene
from ros_scenesense.nodes.attention import AttentionNode
from ros_scenesense.nodes.axiom_learner import AxiomLearnerNode
from ros_scenesense.nodes.grounding import GroundingNode
from ros_scenesense.nodes.grounding_control import GroundingControlNode
from ros_scenesense.nodes.reasoner import ReasonerNode
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.resources import resource
from ros_scenesense.stages.axiom_learner import AxiomLearnerConfiguration, AxiomLearnerStage
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage

WITHHELD = "s1,s2,s3,o1,o2,o3"
GOAL = "on(red_cylinder, white_cube)"


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
        self.beliefs = self.probe.collect(Beliefs)
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


@pytest.fixture
def filled_pool(tmp_path):
    """The state folder of a learner that has seen labelled scenes, and learned nothing yet."""
    learner = AxiomLearnerStage(AxiomLearnerConfiguration(cycle_scenes=0, state_dir=str(tmp_path)))
    reasoner = ReasonerStage(ReasonerConfiguration(withheld=WITHHELD))
    pipeline = Pipeline([reasoner, learner], itertools.count(1).__next__)
    for message in scenes(50):
        pipeline.put(message)
    assert all(not isinstance(each, Axioms) or not each.axioms for each in pipeline.run())
    pipeline.close()
    return str(tmp_path)


def test_the_papers_first_trace_in_the_simulated_world(ros_room, filled_pool):
    trace = str(resource("config", "scenes/trace_1.yaml"))
    learner = ros_room.add(AxiomLearnerNode, cycle_scenes=0, trees=20, state_dir=filled_pool)
    graph = Graph(ros_room, {"withheld": WITHHELD}, scene_files=trace)
    axioms = graph.probe.collect(Axioms)
    knowledge = graph.probe.collect(Knowledge)
    assert ros_room.wait_for(lambda: graph.scenes, timeout_s=60.0)
    process = subprocess.Popen(
        [sys.executable, "-m", "ros_scenesense.cli.main", "goal", GOAL],
        stdout=subprocess.PIPE,
        text=True,
        env=dict(os.environ),
    )
    assert ros_room.wait_for(lambda: process.poll() is not None, timeout_s=120.0)
    output, _ = process.communicate()
    assert (process.returncode, output.splitlines()[-1].startswith("reached in")) == (0, True)
    first, again, *_, last = graph.plans
    assert (len(first.actions), len(again.actions)) == (6, 2)
    assert first.actions[3].location == "yellow_duck"
    assert again.reason.endswith("on(white_cube, table) was seen: fall(white_cube)")
    assert ["red_cylinder", "white_cube"] in graph.structures(last.scene_id)

    # What it did not expect is an example, from which and from its pool it has learned.
    assert ros_room.wait_for(lambda: axioms and axioms[-1].cycle >= 1, timeout_s=60.0)
    assert learner.health.counters["examples_of_outcomes"] == 1
    assert learner.health.counters["outcomes_kept"] == 6
    learned = {each.text: each.id for each in axioms[-1].axioms}
    assert "-stable(A) if irregular_below(A)." in learned
    assert ros_room.wait_for(
        lambda: set(learned.values()) <= {each.id for each in knowledge[-1].axioms}
    )

    # The same goal in the same scene: the paper's second plan.
    client = graph.probe.node.create_client(Trigger, "reset")
    assert ros_room.wait_for(client.service_is_ready)
    shown = len(graph.scenes)
    client.call_async(Trigger.Request())
    assert ros_room.wait_for(lambda: len(graph.scenes) > shown, timeout_s=60.0)
    fresh = graph.scenes[-1].scene_id
    assert ros_room.wait_for(lambda: any(each.scene_id == fresh for each in graph.beliefs))
    planned = len(graph.plans)
    assert graph.want(GOAL).outcome == "reached"
    (better, _) = graph.plans[planned:]
    assert len(better.actions) == 6
    assert better.actions[3] == PlannedAction(kind="putdown", object="white_cube", location="table")
