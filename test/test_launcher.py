"""The launcher: its policy of restarts, and real processes started, watched and stopped."""

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest
from conftest import Probe, holds
from rclpy.node import Node
from std_msgs.msg import String

from ros_scenesense.errors import LaunchError, ParameterError
from ros_scenesense.launcher import Graph, GraphOptions
from ros_scenesense.launcher import graph as launcher_graph
from ros_scenesense.launcher import process as launcher_process
from ros_scenesense.launcher.process import NodeProcess, stop_all
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.codec import encode
from ros_scenesense.messages.grounding import Groundings
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.nodes.registry import DEFAULT_NODES

# The policy of restarts, without processes


class Clock:
    now = 1000.0

    def monotonic(self):
        return self.now


def test_delays_double_and_too_many_deaths_end_it(monkeypatch, tmp_path):
    clock = Clock()
    monkeypatch.setattr(launcher_process, "time", clock)
    node = NodeProcess("node", [], {}, tmp_path / "node.log")
    assert [node.plan_restart() for _ in range(6)] == [0.1, 0.2, 0.4, 0.8, 1.6, None]
    # Old deaths are forgotten.
    clock.now += launcher_process.RESTART_WINDOW_S + 1.0
    assert node.plan_restart() == 0.1


@pytest.fixture
def watched(monkeypatch, tmp_path):
    """A launcher that hears only what a test lets it hear, with one node: clock, graph, node.

    The node is a process that sleeps; `passes` is what each of the launcher's looks takes.
    """
    clock = Clock()
    for module in (launcher_graph, launcher_process):
        monkeypatch.setattr(module, "time", clock)
    reports: list[str] = []
    graph = Graph(GraphOptions(nodes=(), log_dir=tmp_path, silence_s=10.0), reports.append)
    graph.reports = reports
    graph.passes = 0.1

    def spin_once(timeout_sec: float) -> None:
        assert timeout_sec == 0.1
        clock.now += graph.passes

    graph.executor = SimpleNamespace(spin_once=spin_once)
    graph._started = graph._polled = clock.now
    node = graph.nodes["reasoner"] = NodeProcess("reasoner", [], dict(os.environ), tmp_path / "log")
    node._command = [sys.executable, "-c", "import time; time.sleep(600)"]
    graph._start(node)
    hear(graph, "reasoner", node.pid)
    yield clock, graph, node
    node.kill()
    node.wait(20.0)


def hear(graph, name: str, process_id: int) -> None:
    heartbeat = Heartbeat(
        stamp=Stamp.of(0), node=name, process_id=process_id, ready=True, warm=True, counters={}
    )
    graph._hear(String(data=encode(heartbeat).decode()))


@pytest.mark.parametrize("in_a_callback", [True, False])
def test_nobody_is_silent_while_the_launcher_is_busy(watched, in_a_callback):
    clock, graph, node = watched
    for _ in range(5):
        graph.passes = 15.0 if in_a_callback else 0.1
        clock.now += 0.0 if in_a_callback else 15.0
        graph.poll()
        assert node.exit_code is None
    graph.passes = 0.1
    for _ in range(80):  # 8 s, of the 10 that are too many
        graph.poll()
    assert not any("gave no sign of life" in line for line in graph.reports)
    for _ in range(30):
        graph.poll()
    assert any("reasoner gave no sign of life for 10 s" in line for line in graph.reports)


def test_time_in_which_nobody_listened_is_no_credit(watched):
    _, _, node = watched
    node.excuse(1000.0)
    assert node.silent_s == 0.0


def test_of_strangers_each_is_told_once_and_not_without_end(watched):
    _, graph, node = watched
    graph.reports.clear()
    before = node.pid
    node.kill()
    node.wait(20.0)
    graph._start(node)
    for process_id in (before, node.pid):
        hear(graph, "reasoner", process_id)
    hear(graph, "somebody", 1)
    assert not any("somebody else" in line for line in graph.reports)
    for process_id in range(2_000_000, 2_000_100):
        hear(graph, "reasoner", process_id)
        hear(graph, "reasoner", process_id)
    told = [line for line in graph.reports if "somebody else" in line]
    assert len(told) == len(set(told)) == launcher_graph._STRANGERS


def test_a_process_that_ignores_requests_is_killed_with_its_children(monkeypatch, tmp_path):
    script = (
        "import signal, subprocess, sys, time\n"
        "for number in (signal.SIGINT, signal.SIGTERM): signal.signal(number, signal.SIG_IGN)\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
        "print(child.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    steps = ((signal.SIGINT, 0.2), (signal.SIGTERM, 0.2), (signal.SIGKILL, 5.0))
    monkeypatch.setattr(launcher_process, "STOP_STEPS", steps)
    node = NodeProcess("node", [], dict(os.environ), tmp_path / "node.log")
    node._command = [sys.executable, "-c", script]
    node.start()
    assert holds(lambda: node.last_lines())
    child = int(node.last_lines()[0])
    stop_all([node])
    assert node.exit_code == -signal.SIGKILL
    assert holds(lambda: not is_running(child))


def is_running(pid: int) -> bool:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


# Real processes


class Launched:
    """The running graph, its reports, and the estimates that it gives."""

    def __init__(self, tmp_path):
        self.reports = []
        options = GraphOptions(
            log_dir=tmp_path / "logs",
            state_dir=tmp_path / "state",
            silence_s=2.0,
            overrides={"simulated_camera": {"autostart": "true", "resend_s": "2"}},
        )
        self.graph = Graph(options, self.reports.append)
        self.graph.start()
        self.node = Node("probe", namespace=options.namespace, context=self.graph.context)
        self.graph.executor.add_node(self.node)
        self.probe = Probe(self.node)
        self.estimates = self.probe.collect(Estimates)

    def wait_for_scenes(self, more: int) -> bool:
        goal = len(self.estimates) + more
        return self.graph.spin_until(lambda: len(self.estimates) >= goal, timeout_s=40.0)

    def said(self, words: str) -> bool:
        return self.graph.spin_until(
            lambda: any(words in line for line in self.reports), timeout_s=20.0
        )


@pytest.fixture(scope="module")
def launched(tmp_path_factory):
    running = Launched(tmp_path_factory.mktemp("graph"))
    yield running
    running.node.destroy_node()
    running.graph.stop()


def test_all_nodes_become_ready_and_decide_scenes(launched):
    launched.graph.wait_ready(timeout_s=40.0)
    assert launched.graph.ready_s >= max(node.ready_s for node in launched.graph.nodes.values())
    assert launched.said("all nodes are ready")
    assert launched.wait_for_scenes(3)


def test_warnings_of_the_nodes_are_passed_on(launched):
    publisher = launched.probe.publisher(Groundings)
    assert launched.graph.spin_until(lambda: publisher.get_subscription_count() > 0, 20.0)
    launched.probe.say_text(Groundings, "nonsense")
    assert launched.said("grounding_control: message on 'groundings' is ignored")


def test_a_second_graph_in_the_same_room_is_told_of(launched):
    stranger = msgspec.structs.replace(
        launched.graph.nodes["reasoner"].heartbeat, process_id=os.getpid()
    )
    publisher = launched.probe.publisher(Heartbeat)
    assert launched.graph.spin_until(lambda: publisher.get_subscription_count() > 0, 20.0)
    launched.probe.say(stranger)
    assert launched.said(f"a node 'reasoner' of somebody else (process {os.getpid()})")


def test_a_killed_node_is_started_again_and_scenes_go_on(launched):
    grounding = launched.graph.nodes["grounding"]
    old = grounding.pid
    os.kill(old, signal.SIGKILL)
    assert launched.said("grounding died (killed by signal 9), starts again in 0.1 s")
    assert launched.graph.spin_until(lambda: grounding.ready, timeout_s=20.0)
    assert (grounding.pid != old, grounding.restarts) == (True, 1)
    assert launched.wait_for_scenes(2)


def test_a_killed_camera_goes_on_with_its_session(launched):
    before = len(launched.estimates)
    os.kill(launched.graph.nodes["simulated_camera"].pid, signal.SIGKILL)
    assert launched.said("simulated_camera died (killed by signal 9)")
    assert launched.wait_for_scenes(4)
    ids = [estimates.scene_id for estimates in launched.estimates]
    assert len({scene_id.rpartition("-")[0] for scene_id in ids}) == 1
    assert len(set(ids[before:]) - set(ids[:before])) >= 4


def test_a_silent_node_is_killed_and_started_again(launched):
    control = launched.graph.nodes["grounding_control"]
    os.kill(control.pid, signal.SIGSTOP)
    assert launched.said("grounding_control gave no sign of life")
    assert launched.graph.spin_until(lambda: control.ready and control.restarts == 1, 20.0)
    assert launched.wait_for_scenes(2)


def test_own_nodes_are_no_strangers(launched):
    pids = {str(node.pid) for node in launched.graph.nodes.values()}
    told = [line for line in launched.reports if "somebody else" in line]
    assert len(told) == 1
    assert not any(pid in told[0] for pid in pids)


def test_stopping_ends_all_nodes_cleanly(launched):
    nodes = launched.graph.nodes.values()
    workers = [pid for node in nodes for pid in children_of(node.pid)]
    assert workers
    launched.graph.executor.remove_node(launched.node)
    launched.graph.stop()
    assert {node.name: node.exit_code for node in nodes} == dict.fromkeys(DEFAULT_NODES, 0)
    assert holds(lambda: not any(map(is_running, workers)))
    launched.graph.stop()


def children_of(pid: int) -> list[int]:
    """The processes that any thread of a process started."""
    files = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(word) for file in files for word in file.read_text().split()]


def test_a_node_that_cannot_start_is_named_with_the_end_of_its_log(tmp_path):
    (tmp_path / "file").write_text("no folder")
    options = GraphOptions(
        nodes=("simulated_camera",), state_dir=tmp_path / "file", log_dir=tmp_path / "logs"
    )
    with Graph(options) as graph, pytest.raises(LaunchError) as failed:
        graph.wait_ready(timeout_s=40.0)
    assert "simulated_camera cannot start (exit code 1)" in str(failed.value)
    assert str(tmp_path / "file") in str(failed.value).partition(":\n")[2]


def test_a_parameter_that_the_node_itself_refuses_ends_with_its_line(tmp_path):
    options = GraphOptions(
        nodes=("reasoner",), log_dir=tmp_path, overrides={"reasoner": {"withheld": "s9"}}
    )
    with Graph(options) as graph, pytest.raises(ParameterError) as refused:
        graph.wait_ready(timeout_s=40.0)
    assert str(refused.value).startswith("reasoner: parameter 'withheld' is 's9'")
    assert "\n" not in str(refused.value)


def test_nodes_that_are_not_ready_in_time_are_named(tmp_path):
    options = GraphOptions(nodes=("reasoner",), log_dir=tmp_path)
    with Graph(options) as graph, pytest.raises(LaunchError, match="not ready after 0 s: reasoner"):
        graph.wait_ready(timeout_s=0.0)


def test_topics_get_the_names_of_a_camera_driver(tmp_path):
    options = GraphOptions(
        nodes=("grounding",),
        log_dir=tmp_path,
        remaps=("camera/color/image_raw:=/driver/rgb", "camera/color/camera_info:=/driver/info"),
        overrides={"grounding": {"scene_source": "self"}},
    )
    with Graph(options) as graph:
        probe = Node("probe", context=graph.context, use_global_arguments=False)
        try:
            for topic in ("/driver/rgb", "/driver/info", "/scenesense/camera/depth_registered/"):
                name = topic + "image_rect" if topic.endswith("/") else topic
                assert graph.spin_until(lambda name=name: probe.count_subscribers(name), 40.0), name
            assert probe.count_subscribers("/scenesense/camera/color/image_raw") == 0
            assert probe.count_subscribers("/scenesense/camera/instances") == 0
        finally:
            probe.destroy_node()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_command_stops_cleanly(tmp_path, number):
    arguments = ["--nodes", "grounding_control", "--log-dir", str(tmp_path)]
    launcher = subprocess.Popen(
        [sys.executable, "-m", "ros_scenesense.launcher", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        lines = []
        for line in launcher.stdout:
            lines.append(line)
            if "all nodes are ready" in line:
                launcher.send_signal(number)
        assert launcher.wait(timeout=20.0) == 0, lines
        assert lines[-1] == "all nodes are stopped\n"
    finally:
        launcher.kill()


def test_nodes_end_when_their_launcher_is_killed(tmp_path):
    arguments = ["--nodes", "grounding_control", "--log-dir", str(tmp_path)]
    launcher = subprocess.Popen(
        [sys.executable, "-m", "ros_scenesense.launcher", *arguments],
        stdout=subprocess.PIPE,
        text=True,
    )
    for line in launcher.stdout:
        if "all nodes are ready" in line:
            break
    [node] = children_of(launcher.pid)
    launcher.kill()
    launcher.wait()
    assert holds(lambda: not is_running(node))
