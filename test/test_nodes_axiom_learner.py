"""The axiom learner as a node: learned axioms reach the reasoner; its service and requests."""

from learning_samples import scenes
from std_srvs.srv import Trigger

from ros_scenesense.messages.learning import AxiomRequest, AxiomResult, Axioms, JobProgress
from ros_scenesense.messages.reasoning import Beliefs, Knowledge
from ros_scenesense.nodes.axiom_learner import AxiomLearnerNode
from ros_scenesense.nodes.reasoner import ReasonerNode


def test_scenes_become_axioms_that_the_reasoner_uses(ros_room, tmp_path):
    room = ros_room
    room.add(ReasonerNode, withheld="s1,s2,s3,o1,o2,o3")
    node = room.add(AxiomLearnerNode, cycle_scenes=0, trees=20, state_dir=str(tmp_path))
    probe = room.probe()
    axioms, knowledge, beliefs, progress, results = (
        probe.collect(kind) for kind in (Axioms, Knowledge, Beliefs, JobProgress, AxiomResult)
    )
    client = probe.node.create_client(Trigger, "axiom_learner/learn")

    def learn():
        future = client.call_async(Trigger.Request())
        assert room.wait_for(future.done)
        return future.result()

    assert room.wait_for(client.service_is_ready)
    assert not learn().success
    assert room.wait_for(lambda: axioms and knowledge)
    for message in scenes(30):
        probe.say(message)
    assert room.wait_for(lambda: len(beliefs) == 30)
    assert room.wait_for(lambda: node.health.counters["scenes_kept"] == 30)
    answer = learn()
    assert answer.success, answer.message
    assert room.wait_for(lambda: progress and progress[-1].state == "done", timeout_s=60.0)
    assert room.wait_for(lambda: axioms[-1].cycle == 1)
    learned = {each.id: each.text for each in axioms[-1].axioms}
    assert "-occluded(A) if not behind(A, B)." in learned.values()
    assert room.wait_for(
        lambda: {e.id for e in knowledge[-1].axioms if e.origin == "learned"} == set(learned)
    )
    for message in scenes(1, seed=4, first=50):
        probe.say(message)
    assert room.wait_for(lambda: len(beliefs) == 31)
    used = {name for each in beliefs[-1].objects for name in each.occluded.axioms}
    assert used & set(learned)
    name = next(iter(learned))
    probe.say(AxiomRequest(axiom=name, request="veto", id="one"))
    assert room.wait_for(lambda: results and results[-1].outcome == "done")
    assert room.wait_for(lambda: name not in {each.id for each in knowledge[-1].axioms})
