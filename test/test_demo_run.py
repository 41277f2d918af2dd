"""`scenesense demo` as a user runs it: real nodes, a run folder, exit codes, and no orphans."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from test_demo_view import console, printed

from ros_scenesense.cli import main as cli
from ros_scenesense.demo import domains
from ros_scenesense.demo import run as run_module
from ros_scenesense.demo.run import Demo, DemoOptions, show_result
from ros_scenesense.demo.summary import read_summary
from ros_scenesense.errors import LaunchError, ParameterError
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.codec import decode
from ros_scenesense.nodes.registry import DEFAULT_NODES

TIMEOUT_S = 90
STRING = "std_msgs/msg/String"


def demo(folder: Path, *words: str) -> subprocess.Popen:
    command = [
        sys.executable,
        "-m",
        "ros_scenesense.cli.main",
        "demo",
        "--out",
        str(folder),
        *words,
    ]
    environment = {**os.environ, "TERM": "dumb", "OMP_NUM_THREADS": "1"}
    environment.pop("ROS_DOMAIN_ID", None)
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
    )


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_scenes_go_through_the_real_graph_and_into_a_bag(tmp_path):
    process = demo(tmp_path, "--scenes", "3", "--seed", "5", "--arrangement", "towers", "--record")
    text, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, text
    summary = read_summary(tmp_path / "summary.json")
    assert (summary.outcome, summary.scenes, summary.lost) == ("complete", 3, 0)
    assert summary.error is None
    assert set(summary.nodes) == {*DEFAULT_NODES, "recorder"}
    assert summary.nodes["reasoner"].counters["scenes_classified"] == 3
    assert summary.tasks["stability"].total > 3
    assert summary.tasks["stability"].wrong == 0
    for task, final in summary.finals.items():
        reasoned = summary.tasks[task]
        open_after_reasoning = reasoned.total - reasoned.strict - reasoned.by_default
        assert final.total == reasoned.total
        assert final.by_source["network"].total + final.undecided == open_after_reasoning
    assert summary.finals["stability"].by_source["network"].total > 0
    assert summary.knowledge.axioms
    report = (tmp_path / "report.html").read_text()
    assert len(re.findall('class="card scene"', report)) == 3
    assert "was not received" not in report
    assert [f"scene {n}/3:" in text for n in (1, 2, 3)] == [True] * 3
    assert str(tmp_path / "report.html") in text
    (bag,) = tmp_path.glob("bag-*")
    assert str(bag) in text
    _check_bag(bag)


def _check_bag(bag: Path) -> None:
    """Two readers that know nothing of SceneSense see the same, and its scenes in it."""
    with Reader(bag) as reader:
        connections = {each.topic: each for each in reader.connections}
        estimates = [
            (stamp_ns, data)
            for _, stamp_ns, data in reader.messages([connections["/scenesense/estimates"]])
        ]
        counts = {each.topic: each.msgcount for each in reader.connections if each.msgcount}
    texts = [
        get_typestore(Stores.ROS2_JAZZY).deserialize_cdr(data, STRING) for _, data in estimates
    ]
    assert len({decode(text.data, Estimates).scene_id for text in texts}) == 3
    assert counts["/scenesense/camera/color/image_raw"] >= 3
    with (bag / f"{bag.name}_0.mcap").open("rb") as file:
        mcap = make_reader(file)
        statistics, channels = mcap.get_summary().statistics, mcap.get_summary().channels
        seen = [
            (message.log_time, message.data)
            for _, _, message in mcap.iter_messages(topics=["/scenesense/estimates"])
        ]
        schemas = {schema.name: schema for schema in mcap.get_summary().schemas.values()}
    assert seen == estimates
    assert statistics.message_count == sum(counts.values())
    assert {channel.topic for channel in channels.values()} == set(connections)
    assert schemas[STRING].encoding == "ros2msg"
    assert b"string data" in schemas[STRING].data


def test_interrupt_stops_the_graph_and_writes_what_was_seen(tmp_path):
    process = demo(tmp_path, "--scenes", "1000")
    watchdog = threading.Timer(TIMEOUT_S, process.kill)
    watchdog.start()
    text = ""
    for line in process.stdout:
        text += line
        if line.startswith("scene "):
            break
    pids = _node_pids(process.pid)
    process.send_signal(signal.SIGINT)
    text += process.communicate(timeout=TIMEOUT_S)[0]
    watchdog.cancel()
    assert process.returncode == 130, text
    summary = read_summary(tmp_path / "summary.json")
    assert summary.outcome == "interrupted"
    assert summary.scenes >= 1
    assert len(pids) == len(DEFAULT_NODES)
    assert not any(is_alive(pid) for pid in pids)


def _node_pids(parent: int) -> list[int]:
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text()
    return [int(pid) for pid in children.split()]


class StandInGraph:
    """Starts nothing; does what a test wants where the demo waits for the nodes."""

    ready_s = None

    def __init__(self, behaviour):
        self._behaviour = behaviour

    def __enter__(self):
        raise self._behaviour

    def __exit__(self, *_):
        return None


@pytest.mark.parametrize(
    ("behaviour", "outcome", "said"),
    [
        (LaunchError("grounding cannot start"), "failed", "grounding cannot start"),
        (KeyboardInterrupt(), "interrupted", "stopped by the user"),
    ],
)
def test_whatever_ends_the_run_it_is_written(tmp_path, monkeypatch, behaviour, outcome, said):
    monkeypatch.setattr(run_module, "Graph", lambda *_a, **_k: StandInGraph(behaviour))
    target = console()
    result = Demo(DemoOptions(out=str(tmp_path), domain_id=7), target).run()
    show_result(result, target)
    summary = read_summary(tmp_path / "summary.json")
    assert (summary.outcome, summary.error, summary.scenes) == (outcome, said, 0)
    assert said in (tmp_path / "report.html").read_text()
    assert "0 of 20 scenes" in printed(target)


@pytest.mark.parametrize(
    ("words", "named", "allowed"),
    [
        (["--scenes", "0"], "scenes", "from 1 to 1000"),
        (["--scenes", "many"], "scenes", "an integer"),
        (["--arrangement", "heap"], "arrangement", "towers"),
        (["--domain-id", "500"], "domain_id", "from 0 to 101"),
        (["--timeout", "-3"], "timeout", "at least 1"),
        (["--seed", "1.5"], "seed", "an integer"),
        (["--params", "/no/such/file.yaml"], "/no/such/file.yaml", ""),
        (["--out", "/dev/null/x"], "/dev/null/x", ""),
        (["-p", "reasoner.withheld"], "reasoner.withheld", "node.parameter=value"),
        (["-p", "reasoner.with_held=s1"], "with_held", "withheld"),
        (["-p", "simulated_camera.scenes=3"], "simulated_camera.scenes", "--scenes"),
    ],
)
def test_wrong_values_end_with_one_line_and_exit_code_2(
    tmp_path, monkeypatch, capsys, words, named, allowed
):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["demo", *words]) == 2
    error = capsys.readouterr().err
    assert named in error
    assert allowed in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_run_folders_do_not_collide(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run_module, "Graph", lambda *_a, **_k: StandInGraph(KeyboardInterrupt()))
    folders = {Demo(DemoOptions(domain_id=7), console()).run().folder for _ in range(3)}
    assert len(folders) == 3
    assert all((folder / "summary.json").is_file() for folder in folders)


def test_the_domain_of_the_user_is_kept(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "31")
    assert domains.choose_domain(None) == 31
    assert domains.choose_domain(8) == 8
    monkeypatch.setenv("ROS_DOMAIN_ID", "many")
    with pytest.raises(ParameterError, match="ROS_DOMAIN_ID"):
        domains.choose_domain(None)


def test_a_domain_in_use_is_not_chosen(monkeypatch):
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    first = domains.choose_domain(None)
    monkeypatch.setattr(domains.random, "sample", lambda *_: [first])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", 7400 + 250 * first + 10))
        with pytest.raises(ParameterError, match="--domain-id"):
            domains.choose_domain(None)
