"""`scenesense timing`: what is heard of a graph, as a table and as CSV."""

import threading

import pytest
from std_msgs.msg import Float32

from ros_scenesense.cli import main as cli
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.lean_node import LeanNode
from ros_scenesense.nodes.qos import profile_of

FIRST_LINE = "stamp_s,step,milliseconds\n"


@pytest.fixture
def steps(ros_room):
    """Somebody who times a step again and again."""
    node = ros_room.add(LeanNode, "grounding")
    publisher = node.create_publisher(
        Float32, "timing/grounding/total", profile_of(QosClass.REQUEST)
    )
    over = threading.Event()

    def publish():
        while not over.wait(0.02):
            publisher.publish(Float32(data=12.5))

    thread = threading.Thread(target=publish)
    thread.start()
    yield
    over.set()
    thread.join()


@pytest.mark.usefixtures("steps")
def test_steps_of_a_running_graph_are_summed_up_and_written(tmp_path, capsys):
    file = tmp_path / "steps.csv"
    assert cli.main(["timing", "--seconds", "0.3", "--csv", str(file)]) == 0
    said = capsys.readouterr().out
    assert "grounding/total" in said
    first, *lines = file.read_text().splitlines(keepends=True)
    assert first == FIRST_LINE
    assert {line.split(",", 1)[1] for line in lines} == {"grounding/total,12.5\n"}
    assert cli.main(["timing", str(file)]) == 0
    assert capsys.readouterr().out == said


def test_a_file_is_summed_up_by_step(tmp_path, capsys):
    file = tmp_path / "steps.csv"
    lines = [f"{number},reasoner/classify,{number}\n" for number in range(101)]
    file.write_text(FIRST_LINE + "".join(lines) + "7,attention/re\x1b[0m,3\n")
    assert cli.main(["timing", str(file)]) == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if "classify" in line)
    assert row.split() == ["reasoner/classify", "101", "50.00", "95.00", "100.00"]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", ":1: the first line must be"),
        ("step,ms\n", ":1: the first line must be"),
        (FIRST_LINE + "1,a,2\n1,a\n", ":3: must hold"),
        (FIRST_LINE + "1,a,nan\n", ":2: must hold"),
    ],
)
def test_a_file_that_is_none_is_refused_with_the_line(tmp_path, capsys, content, said):
    file = tmp_path / "steps.csv"
    file.write_text(content)
    assert cli.main(["timing", str(file)]) == 1
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [["--seconds", "-1"], ["--seconds", "nan"], ["a.csv", "--csv", "b.csv"]]
)
def test_wrong_values_end_with_exit_code_2(words):
    assert cli.main(["timing", *words]) == 2


def test_a_file_that_cannot_be_written_is_one_line(tmp_path, capsys):
    file = tmp_path / "missing" / "steps.csv"
    assert cli.main(["timing", "--csv", str(file)]) == 1
    assert "cannot be written" in capsys.readouterr().err
