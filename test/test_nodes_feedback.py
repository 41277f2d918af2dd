"""Feedback through real nodes: camera, grounding, control and command; restarts and SIGKILL."""

import os
import signal
import subprocess
import sys

import pytest
from grounding_samples import groundings
from std_msgs.msg import Float32
from std_srvs.srv import Trigger

from ros_scenesense.messages.grounding import (
    Feedback,
    FeedbackResult,
    Groundings,
    MsrUpdate,
    Relations,
    Trust,
)
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.grounding import GroundingNode
from ros_scenesense.nodes.grounding_control import GroundingControlNode
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.nodes.simulated_camera import SimulatedCameraNode

NODE = [sys.executable, "-m", "ros_scenesense.nodes", "grounding_control"]
# The same node, killed at the first word about a feedback that is already in its file.
KILLED_BEFORE_PUBLISHING = """
import os, signal, sys
from ros_scenesense.messages.grounding import FeedbackResult
from ros_scenesense.nodes import base, grounding_control

publish = base.StageNode.publish
def publish_or_die(node, item):
    if isinstance(item, FeedbackResult):
        os.kill(os.getpid(), signal.SIGKILL)
    publish(node, item)
base.StageNode.publish = publish_or_die
sys.exit(grounding_control.main())
"""


class Listener:
    """A probe that hears all that control says."""

    def __init__(self, room):
        self.room = room
        self.probe = room.probe()
        kinds = (Groundings, Relations, Trust, MsrUpdate, FeedbackResult)
        self.heard = {kind: self.probe.collect(kind) for kind in kinds}

    def wait_for_control(self) -> None:
        publisher = self.probe.publisher(Feedback)
        assert self.room.wait_for(lambda: publisher.get_subscription_count() == 1)

    def next(self, kind, before: int):
        assert self.room.wait_for(lambda: len(self.heard[kind]) > before, timeout_s=40.0)
        return self.heard[kind][before]

    def tell(self, relation: str, object: str, reference: str, **values) -> FeedbackResult:
        before = len(self.heard[FeedbackResult])
        self.probe.say(Feedback(relation=relation, object=object, reference=reference, **values))
        return self.next(FeedbackResult, before)

    def last_id(self) -> int:
        return max((one.id for one in self.heard[MsrUpdate]), default=0)


class Robot(Listener):
    """Camera, grounding and control with a state folder; the two latter can be started anew."""

    def __init__(self, room, state):
        super().__init__(room)
        self.state = str(state)
        self.start()
        self.camera = room.add(
            SimulatedCameraNode,
            autostart=False,
            arrangement="relations",
            width=160,
            height=120,
            # Nobody decides: scenes wait for their estimates, and would come again.
            in_flight=8,
            resend_s=600.0,
        )
        self.next_scene = self.probe.node.create_client(Trigger, "next_scene")
        assert room.wait_for(self.next_scene.service_is_ready)

    def start(self) -> None:
        self.control = self.room.add(GroundingControlNode, state_dir=self.state, resend_s=0.2)
        self.grounding = self.room.add(GroundingNode, state_dir=self.state)
        self.wait_for_control()

    def restart(self) -> None:
        for node in (self.control, self.grounding):
            self.room.remove(node)
        publisher = self.probe.publisher(Feedback)
        assert self.room.wait_for(lambda: publisher.get_subscription_count() == 0)
        self.start()

    def show_scene(self) -> tuple[Groundings, Relations]:
        seen, settled = len(self.heard[Groundings]), len(self.heard[Relations])
        answer = self.next_scene.call_async(Trigger.Request())
        assert self.room.wait_for(answer.done)
        return self.next(Groundings, seen), self.next(Relations, settled)

    def wait_until_learned(self) -> None:
        """Waits until grounding has applied all that control has written."""
        written = self.control.stage._ledger.last_update
        assert self.room.wait_for(lambda: self.learned()[0] == written(), timeout_s=40.0)

    def learned(self) -> tuple[int, list]:
        store = self.grounding.stage._store
        return store.applied, store.memory.model.counts.tolist()


def test_feedback_teaches_and_all_that_was_learned_survives_a_restart(ros_room, tmp_path):
    robot = Robot(ros_room, tmp_path)
    plotted = robot.probe.collect_raw(
        Float32, "figures/grounding_control/trust_qsr", profile_of(QosClass.STATE)
    )
    first, relations = robot.show_scene()
    assert (first.applied_update, {pair.msr for pair in first.pairs}) == (0, {None})
    relation = relations.relations[0]
    result = robot.tell(relation.position.value, relation.object, relation.reference)
    assert (result.outcome, result.scene_id) == ("accepted", first.scene_id)
    assert ros_room.wait_for(lambda: robot.heard[Trust][-1].revision == 1)
    trust = robot.heard[Trust][-1]
    assert trust.feedback_count == 1
    assert trust.qsr > 0.9
    assert ros_room.wait_for(lambda: plotted and plotted[-1].data == pytest.approx(trust.qsr))
    robot.wait_until_learned()
    told, _ = robot.learned()

    second, _ = robot.show_scene()
    assert second.applied_update >= told
    assert all(pair.msr is not None for pair in second.pairs)
    robot.wait_until_learned()

    before = robot.learned()
    heard = len(robot.heard[Trust])
    robot.restart()
    assert robot.learned() == before
    after = robot.next(Trust, heard)
    assert (after.revision, after.qsr, after.kinds) == (trust.revision, trust.qsr, trust.kinds)
    repeated = robot.tell(
        relation.position.value, relation.object, relation.reference, scene_id=first.scene_id
    )
    assert repeated.outcome == "duplicate"
    third, _ = robot.show_scene()
    assert third.applied_update == before[0]
    assert all(pair.msr is not None for pair in third.pairs)


def test_a_kill_between_writing_and_publishing_loses_and_doubles_nothing(ros_room, tmp_path):
    listener = Listener(ros_room)
    arguments = ["--ros-args", "-r", "__ns:=/scenesense", "-p", f"state_dir:={tmp_path}"]
    first = subprocess.Popen([sys.executable, "-c", KILLED_BEFORE_PUBLISHING, *arguments])
    try:
        listener.wait_for_control()
        listener.probe.say(groundings("s-0"))
        listener.next(Relations, 0)
        listener.probe.say(Feedback(relation="right", object="a", reference="b", id="mine"))
        assert ros_room.wait_for(lambda: first.poll() is not None)
        assert first.returncode == -signal.SIGKILL
    finally:
        first.kill()
    assert listener.heard[FeedbackResult] == []
    assert listener.last_id() == 1
    second = subprocess.Popen([*NODE, *arguments])
    try:
        assert ros_room.wait_for(lambda: listener.last_id() == 2)
        assert ros_room.wait_for(lambda: listener.heard[Trust][-1].feedback_count == 1)
        (sample,) = listener.heard[MsrUpdate][-1].samples
        assert (sample.relation, sample.source) == ("right", "human")
        # The publication is latched twice: by the dead and by the living node.
        assert listener.tell("right", "a", "b", id="mine").outcome == "duplicate"
        assert listener.heard[Trust][-1].feedback_count == 1
    finally:
        second.send_signal(signal.SIGINT)
        second.wait(timeout=20.0)


@pytest.fixture
def control(ros_room):
    """A control node that has seen one scene, of the objects a, b and c."""
    listener = Listener(ros_room)
    ros_room.add(GroundingControlNode)
    listener.wait_for_control()
    listener.probe.say(groundings("s-0"))
    listener.next(Relations, 0)
    return listener


def command(control, *words: str) -> tuple[int, str, str]:
    process = subprocess.Popen(
        [sys.executable, "-m", "ros_scenesense.cli.main", "feedback", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=dict(os.environ),
    )
    assert control.room.wait_for(lambda: process.poll() is not None, timeout_s=40.0)
    output, error = process.communicate()
    return process.returncode, output, error


def test_the_command_tells_the_running_node_and_prints_its_answer(control):
    code, output, error = command(control, "right", "a", "b")
    assert (code, error) == (0, "")
    assert output.startswith("accepted (scene s-0): right(a, b) counts")
    code, output, _ = command(control, "left", "b", "a", "--scene", "s-0")
    assert code == 0
    assert output.startswith("duplicate (scene s-0): right(a, b) was said")
    code, output, _ = command(control, "left", "mug\x1b[2J", "a")
    assert code == 3
    assert output.startswith("refused: 'mug?[2J' was located in none")


def test_hostile_feedback_is_counted_and_the_next_one_judged(control):
    for text in ("", "{", "[1]", '{"relation": "beside"}', '{"relation": "left"}', "\u0000"):
        control.probe.say_text(Feedback, text)
    # What a person types: no envelope at all.
    before = len(control.heard[FeedbackResult])
    control.probe.say_text(Feedback, '{"relation": "left", "object": "a", "reference": "b"}')
    assert control.next(FeedbackResult, before).outcome == "accepted"
    assert len(control.heard[FeedbackResult]) == before + 1
