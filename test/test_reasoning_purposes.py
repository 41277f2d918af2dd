"""Why each action of a plan."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from planning_samples import TRACE_1, scene

from ros_scenesense.cli.main import main
from ros_scenesense.knowledge.literals import Atom
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.reasoning.described_scenes import described_scene
from ros_scenesense.reasoning.planning import plan
from ros_scenesense.reasoning.purposes import Purpose, purposes
from ros_scenesense.reasoning.situations import Situation, robot_domain


def explained(situation: Situation, goal: str) -> tuple[Purpose, ...]:
    task = situation.task(situation.goal(goal))
    return purposes(task, plan(task).plans[0].actions)


def test_each_action_of_the_papers_plan_serves_a_later_one_or_the_goal() -> None:
    """Paper, *Execution Trace* 1, with the learned axiom."""
    situation = Situation(robot_domain(), described_scene(TRACE_1, "trace"))
    found = explained(situation, "on(red_can, white_cube)")
    assert len(found) == 6
    for each in found[:-1]:
        assert each.enables == found[each.step + 1].action
        assert each.enabled_step == each.step + 1
    assert found[0].because == "What is not known to be in the hand cannot be put down."
    assert found[1].because == "A hand that holds something picks up nothing else."
    assert found[-1].enables is None
    assert [str(each) for each in found[-1].achieves] == ["on(red_can, white_cube)"]
    # Without any action the last is not possible or the goal fails, so each is needed.
    assert all(each.enables or each.achieves for each in found)


def test_an_action_too_many_is_told() -> None:
    situation = Situation(robot_domain(), scene([["a"], ["b"]]))
    task = situation.task(situation.goal("on(a, b)"))
    robot, b, table = (Constant(name) for name in ("rob1", "b", "table"))
    round_trip = [Atom("pickup", (robot, b)), Atom("putdown", (robot, b, table))]
    found = purposes(task, [*round_trip, *plan(task).plans[0].actions])
    assert str(found[2]).startswith("without it putdown(rob1, a, b) at step 3 would be impossible")
    assert "the goal" in str(found[3])
    # Picking b up serves nothing but putting it back, which frees the hand for the plan.
    assert (found[0].enables, found[0].achieves) == (round_trip[1], ())
    assert found[1].enables == found[2].action


SCENE = """
objects: {mug: , box: , my ball: }
relations: ["on(mug, box)"]
"""


def test_the_command_explains_a_plan(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    arguments = ["explain", "--goal", "on(mug, object_1)", "--scene", str(path)]
    assert main(arguments) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "0. pickup(rob1, mug)"
    assert lines[-2] == "   without it the goal would not be achieved: on(mug, object_1)"
    assert lines[-1] == "object_1 is 'my ball'."
    assert main([*arguments, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [each["step"] for each in answer["plan"]] == [0, 1]
    assert answer["plan"][1]["achieves"] == ["on(mug, object_1)"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "say either a LITERAL or a --goal"),
        (["stable(a)", "--goal", "on(a, b)"], "say either a LITERAL or a --goal"),
        (["--goal", "on(a, b)"], "--goal needs --scene"),
        (["--goal", "on(a, b)", "--scene", "x", "--svg", "y"], "--svg"),
    ],
)
def test_wrong_arguments_are_refused(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explain", *arguments]) == 2
    assert words in capsys.readouterr().err
