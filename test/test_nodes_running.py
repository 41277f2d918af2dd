"""A node as a process of its own: exit codes, and one line on the standard error."""

import signal
import subprocess
import sys

import pytest

from ros_scenesense.errors import ParameterError
from ros_scenesense.nodes import running

NODE = "ros_scenesense.nodes.grounding_control"
COMMAND = [sys.executable, "-m", "ros_scenesense.nodes", "grounding_control"]


def run_node(*arguments: str, module: str = NODE) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", module, *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.parametrize(
    ("assignment", "said"),
    [
        ("trust_qsr:=7.5", "parameter 'trust_qsr' is 7.5, must be a number from 0 to 1"),
        ("trust_qsr:=much", "parameter 'trust_qsr' is 'much', must be a number from 0 to 1"),
    ],
)
def test_a_wrong_parameter_is_one_line_and_exit_code_2(assignment, said):
    ended = run_node("--ros-args", "-p", assignment)
    assert ended.returncode == 2
    assert ended.stderr == f"grounding_control: {said}\n"


def test_wrong_ros_arguments_are_told_with_exit_code_2():
    ended = run_node("--ros-args", "--params-file", "/no/such.yaml")
    assert ended.returncode == 2
    assert "/no/such.yaml" in ended.stderr.splitlines()[-1]
    assert "Traceback" not in ended.stderr


def test_an_unknown_node_is_one_line_and_exit_code_2():
    ended = run_node("moon", module="ros_scenesense.nodes")
    assert ended.returncode == 2
    assert ended.stderr.startswith("node 'moon' is unknown, known are: simulated_camera")
    assert ended.stderr.count("\n") == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_node_that_is_asked_to_stop_ends_with_0_and_silence(ros_room, number):
    node = subprocess.Popen(
        [*COMMAND, "--ros-args", "-r", f"__ns:=/of_{number}"],
        stderr=subprocess.PIPE,
        text=True,
    )
    probe = ros_room.probe()
    topic = f"/of_{number}/relations"
    assert ros_room.wait_for(lambda: probe.node.count_publishers(topic) > 0)
    node.send_signal(number)
    _, error = node.communicate(timeout=20.0)
    assert (node.returncode, error) == (0, "")


@pytest.mark.parametrize("delay_s", [0.1, 0.4, 0.7])
def test_a_signal_during_the_start_gives_no_traceback(delay_s):
    node = subprocess.Popen(
        COMMAND,
        stderr=subprocess.PIPE,
        text=True,
    )
    with pytest.raises(subprocess.TimeoutExpired):
        node.wait(timeout=delay_s)  # the moment is what is tested
    node.send_signal(signal.SIGINT)
    _, error = node.communicate(timeout=20.0)
    assert node.returncode in (0, -signal.SIGINT)
    assert "Error" not in error


def test_an_exception_in_any_callback_is_told_and_the_node_goes_on(monkeypatch):
    class Failing:
        def spin_once(self):
            raise ValueError("in a callback")

    class Node:
        def __init__(self):
            self.errors = []

        def internal_error(self, error):
            self.errors.append(str(error))

    node = Node()
    monkeypatch.setattr(running.rclpy, "ok", lambda: True)
    running._spin_once(Failing(), node)
    assert node.errors == ["in a callback"]
    # A context that is shut down meanwhile is no error of the node.
    monkeypatch.setattr(running.rclpy, "ok", lambda: False)
    with pytest.raises(ValueError, match="in a callback"):
        running._spin_once(Failing(), node)
    assert node.errors == ["in a callback"]


@pytest.mark.parametrize(("given", "threads"), [({}, "1"), ({"OMP_NUM_THREADS": "4"}, "4")])
def test_a_node_and_its_worker_take_one_core_unless_it_is_said(monkeypatch, given, threads):
    def stop():
        raise ParameterError("far enough")

    environment = dict(given)
    monkeypatch.setattr(running.os, "environ", environment)
    monkeypatch.setattr(running, "_initialise", stop)
    assert running.run("node", lambda: None) == 2
    assert environment["OMP_NUM_THREADS"] == threads
