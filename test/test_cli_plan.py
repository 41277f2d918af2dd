"""`scenesense plan`: answers, exit codes, and one job in a process."""

import json

import pytest
import yaml
from planning_samples import TRACE_1

from ros_scenesense.cli.main import main
from ros_scenesense.stages.one_job import run_once
from ros_scenesense.stages.protocol import JobFailure

GOAL = "on(red_can, white_cube)"


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump(TRACE_1))
    return str(path)


def test_a_plan_is_printed_step_by_step(scene, capsys):
    assert main(["plan", GOAL, "--scene", scene]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "goal: on(red_can, white_cube)",
        "plan, 6 actions:",
        "   0  pickup(rob1, duck)",
        "   1  putdown(rob1, duck, table)",
        "   2  pickup(rob1, white_cube)",
        "   3  putdown(rob1, white_cube, table)",
        "   4  pickup(rob1, red_can)",
        "   5  putdown(rob1, red_can, white_cube)",
    ]


def test_plans_are_counted_by_length_and_given_as_json(scene, capsys):
    assert main(["plan", GOAL, "--scene", scene, "--horizon", "8", "--count", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["outcome"], answer["counts"], answer["complete"]) == (
        "found",
        {"6": 1, "8": 6},
        True,
    )
    assert len(answer["plans"]) == 7


def test_no_plan_is_1_with_what_stands_in_the_way(scene, capsys):
    assert main(["plan", "on(red_can, duck)", "--scene", scene]) == 1
    assert capsys.readouterr().out.splitlines()[1:] == [
        "There is no plan up to step 20.",
        "In the way: putdown(rob1, red_can, duck) at step 5: it would bring about -stable(X)",
    ]


def test_a_domain_with_its_own_history_needs_no_scene(tmp_path, capsys):
    path = tmp_path / "lamp.al"
    path.write_text(
        "sort lamp = {one, two}. inertial fluent lit(lamp). action press(lamp).\n"
        "press(L) causes lit(L). impossible press(L) if lit(L). initially lit(one).\n"
    )
    assert main(["plan", "all lit(L)", "--domain", str(path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "goal: all lit(L)",
        "plan, 1 action:",
        "   0  press(two)",
    ]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["on(red_can", "--scene", "SCENE"], "expected ')'"),
        ([GOAL], "--scene is missing"),
        ([GOAL, "--scene", "SCENE", "--without", "s7"], "no axiom s7"),
        ([GOAL, "--scene", "SCENE", "--max-steps", "0"], "--max-steps"),
        ([GOAL, "--scene", "no/such/file"], "cannot be read"),
        ([GOAL, "--scene", "SCENE", "--domain", "no/such/file"], "cannot be read"),
    ],
)
def test_what_is_wrong_is_2(scene, capsys, arguments, words):
    assert main(["plan", *(scene if each == "SCENE" else each for each in arguments)]) == 2
    assert words in capsys.readouterr().err


def test_a_domain_with_a_history_of_actions_is_no_place_to_start_from(tmp_path, capsys):
    path = tmp_path / "lamp.al"
    path.write_text(
        "inertial fluent lit. action press. press causes lit. initially -lit. hpd(press, 0).\n"
    )
    assert main(["plan", "lit", "--domain", str(path)]) == 2
    assert "says what happened" in capsys.readouterr().err


class Engine:
    def answer(self, number):
        return number + 1

    def fail(self):
        raise ValueError("no")

    def hang(self):
        while True:
            pass


def test_one_job_in_a_process_answers_or_says_why_not():
    assert run_once(Engine, "answer", (1,), 30.0) == 2
    assert run_once(Engine, "fail", (), 30.0) == JobFailure("ValueError: no")
    failure = run_once(Engine, "hang", (), 0.2)
    assert (failure.timed_out, failure.reason) == (True, "stopped after 0.2 s")
