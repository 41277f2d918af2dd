"""The benchmark of the whole loop: its parts, which need no graph, and what it makes of figures."""

import subprocess
import sys

import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import String
from test_nodes_frames import a_frame

from ros_scenesense.bench import loop, loop_fed
from ros_scenesense.bench.forwarding import LINKS, SOURCE, Forwarder, Recorder, qos_of, type_of
from ros_scenesense.bench.loop_graph import Pace, children_of, cpu_s, cpu_table
from ros_scenesense.bench.player import MOST_IN_FLIGHT, Player, Take
from ros_scenesense.bench.restarts import Restart
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.scenes import KnownObject, Scene
from ros_scenesense.nodes.lean_node import LeanNode
from ros_scenesense.simulation.dataset.reader import DatasetReader


def test_the_dataset_has_scenes_of_five_objects_alone(tmp_path):
    loop.make_dataset(tmp_path / "set", 3, seed=4)
    assert [len(record.objects) for record in DatasetReader(tmp_path / "set").records()] == [5] * 3


def test_the_fit_finds_the_law_that_latencies_follow():
    latencies = {n: [3.0 + 2.0 * n + 0.5 * n**2 + noise for noise in (-1, 1)] for n in (5, 10, 40)}
    assert loop_fed.fitted(latencies) == pytest.approx((3.0, 2.0, 0.5))
    full, forwarded = {9.0: [50.0, 40.0, 60.0], 8.0: [9.0]}, {9.0: [5.0, 4.0], 8.0: [3.0]}
    fed = loop_fed.Fed({n: [float(n**2)] for n in (5, 10, 20)}, 2.0, full, forwarded)
    figures = fed.figures()
    assert figures["loop_latency_growth"] == pytest.approx(2.0)
    assert figures["loop_latency_ms_20"] == 400.0
    assert figures["transport_share"] == pytest.approx(0.09)
    assert {name for table in fed.tables().values() for name in table.columns} >= {
        "objects",
        "share",
    }


def test_all_figures_of_the_loop_are_declared():
    fed = loop_fed.Fed({5: [1.0], 10: [1.5], 20: [2.0]}, 2.0, {8.0: [1.0]}, {8.0: [1.0]})
    restarts = [Restart("attention", 1.0, 4.0), Restart("reasoner", 1.0, 2.0)]
    assert loop.restart_figures(restarts) == {"restart_s": 2.0, "restart_attention_s": 4.0}
    declared = {figure.name for figure in loop.FIGURES}
    assert fed.figures().keys() | loop.restart_figures(restarts).keys() < declared


def test_cpu_time_is_told_by_process_and_as_a_sum():
    first = Pace(2.0, [1.0, 3.0], {"grounding": 2.0, "grounding, worker": 5.0})
    second = Pace(2.0, [1.0], {"grounding": 4.0})
    table = cpu_table({"played": first, "simulated": second})
    assert table.rows == [
        ["grounding", 2.0, 4.0],
        ["grounding, worker", 5.0, None],
        ["all", 7.0, 4.0],
    ]
    assert first.latency_ms(50.0) == 2.0


def test_cpu_time_of_children_and_their_children_is_found():
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'input()'])"
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)
    try:
        while not (found := children_of(process.pid)):
            assert process.poll() is None
        assert cpu_s(found[0]) >= 0.0
    finally:
        process.communicate(b"\n", timeout=20.0)
    assert children_of(process.pid) == []
    assert cpu_s(process.pid) == 0.0


def a_take() -> Take:
    return Take(a_frame(), [KnownObject(instance=1, name="red_cube")])


def settled(scene: Scene) -> Estimates:
    return Estimates(
        stamp=scene.stamp,
        scene_id=scene.scene_id,
        objects=[],
        structures=[],
        knowledge_revision="k",
        trust_revision=0,
    )


def test_a_player_keeps_so_many_scenes_in_flight(ros_room):
    probe = ros_room.probe()
    scenes = probe.collect(Scene)
    player = Player(ros_room.add(LeanNode, "camera"), "b")
    player.play([a_take()], scenes=5, in_flight=2)
    for number in range(5):
        shown = min(5, number + 2)
        assert ros_room.wait_for(lambda shown=shown: len(scenes) == shown)
        probe.say(settled(scenes[number]))
    assert [scene.scene_id for scene in scenes] == [f"b-{number:04d}" for number in range(5)]
    assert scenes[0].objects == a_take().objects


def test_what_was_recorded_of_a_graph_is_forwarded_scene_by_scene(ros_room):
    links = {"source": SOURCE, **LINKS}
    given = {topic: type_of(topic) for link in links.values() for topic in link.gives}
    recording = {topic: [serialize_message(kind())] * 2 for topic, kind in given.items()}
    recording["estimates"] = [serialize_message(String(data=word)) for word in ("one", "two")]
    nodes = {
        name: Forwarder(ros_room.add(LeanNode, name), link, recording)
        for name, link in links.items()
    }
    listener = ros_room.add(LeanNode, "listener")
    heard = []
    listener.create_subscription(
        String, "estimates", lambda message: heard.append(message.data), qos_of("estimates")
    )
    recorder = Recorder(ros_room.add(LeanNode, "recorder"))
    assert ros_room.wait_for(lambda: all(node.connected for node in nodes.values()))
    nodes["source"].give()
    assert ros_room.wait_for(lambda: heard == ["one"])
    nodes["source"].give()
    assert ros_room.wait_for(lambda: heard == ["one", "two"] and recorder.has(2))
    assert recorder.recording == recording
    recorder.close()


def test_at_a_rate_what_would_be_too_much_in_flight_comes_later(ros_room):
    probe = ros_room.probe()
    scenes = probe.collect(Scene)
    player = Player(ros_room.add(LeanNode, "camera"), "b")
    player.play_at([a_take()], scenes=3, rate_hz=200.0)
    assert ros_room.wait_for(lambda: len(scenes) == MOST_IN_FLIGHT)
    assert not ros_room.wait_for(lambda: len(scenes) > MOST_IN_FLIGHT, timeout_s=0.1)
    probe.say(settled(scenes[0]))
    assert ros_room.wait_for(lambda: len(scenes) == 3)
    assert len({scene.stamp for scene in scenes}) == 3
    for scene in scenes[1:]:
        probe.say(settled(scene))
    player.play([a_take()], scenes=2, in_flight=1)
    assert ros_room.wait_for(lambda: len(scenes) == 4)
    assert not ros_room.wait_for(lambda: len(scenes) > 4, timeout_s=0.1)
