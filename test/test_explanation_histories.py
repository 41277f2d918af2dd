"""Explanations of what a domain with a history makes believe."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ros_scenesense.cli.domain_files import load_domain
from ros_scenesense.cli.main import main
from ros_scenesense.errors import LanguageError, ParameterError, ReasoningError
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.translation import Options
from ros_scenesense.reasoning.explanation.histories import (
    HistoryExplanation,
    HistoryExplanationEngine,
)
from ros_scenesense.reasoning.explanation.reason import Role
from ros_scenesense.reasoning.explanation.text import outline

EXAMPLES = Path(__file__).resolve().parent.parent / "asp" / "examples"
LIBRARY = [EXAMPLES / "library.al", EXAMPLES / "library_day.al"]

LAMP = """
sort lamp = {desk, hall}.
inertial fluent on(lamp), broken(lamp).
estimated fluent bright(lamp).
action press(lamp).
pressing "A switch turns a lamp on.": press(L) causes on(L) if not broken(L).
shines "A lamp that is on is bright.": normally bright(L) if on(L).
impossible press(L) if on(L).
"""


def explain(
    literal: str, step: int | None = None, text: str = LAMP, history: str = ""
) -> HistoryExplanation:
    domain = parse(text + history, "lamp.al")
    return HistoryExplanationEngine().explain(domain, Options(), literal, step)


def lines(explained: HistoryExplanation) -> list[str]:
    return outline(explained.reason).splitlines()


HISTORY = "initially -on(desk), -broken(desk). hpd(press(desk), 0)."


def test_a_proof_goes_through_steps_down_to_what_was_done_and_known() -> None:
    explained = explain("bright(desk)", history=HISTORY)
    assert (explained.holds, explained.step, explained.restored) == (True, 1, False)
    assert lines(explained) == [
        "bright(desk) at step 1 by shines: A lamp that is on is bright. (A default.)",
        "├─ on(desk) at step 1 by pressing: A switch turns a lamp on.",
        "│  ├─ press(desk) occurs at step 0: History",
        "│  │  └─ press(desk) was done at step 0: given",
        "│  └─ not broken(desk) at step 0: nothing concludes it",
        "└─ not -bright(desk) at step 1: nothing concludes it",
    ]


def test_an_exception_to_a_default_is_an_assumption_by_a_cr_rule() -> None:
    explained = explain("-bright(desk)", history=f"{HISTORY} obs(bright(desk), false, 1).")
    assert explained.restored
    says = "An exception to this default: A lamp that is on is bright."
    assert lines(explained)[:2] == [
        f"-bright(desk) at step 1 by shines: {says}",
        f"└─ an exception to shines(desk) at step 1, assumed by shines: {says}",
    ]


def test_why_not_begins_with_the_proof_of_the_opposite() -> None:
    explained = explain("on(desk)", 0, history=HISTORY)
    assert not explained.holds
    assert lines(explained)[:2] == [
        "on(desk) at step 0 does not hold",
        "├─ -on(desk) at step 0: given",
    ]
    unknown = explain("on(hall)", 1, history=HISTORY)
    assert not unknown.holds
    assert "├─ not by pressing: A switch turns a lamp on." in lines(unknown)
    assert any("press(hall) was done at step 0 does not hold" in line for line in lines(unknown))


def test_everything_that_an_answer_believes_of_a_morning_is_explained() -> None:
    domain = load_domain(LIBRARY)
    engine = HistoryExplanationEngine()
    explained = engine.explain(domain, Options(), "open(glass_door)", None)
    assert not explained.holds
    assert explained.restored
    text = outline(explained.reason)
    assert "slam(glass_door) happens without the robot at step 2, assumed" in text
    assert text.index("-open(glass_door) at step 3 by") < text.index("(see above)")
    for literal, step in (("at(porter, library)", 3), ("-quiet(kitchen)", 3), ("stuck(porter)", 3)):
        found = engine.explain(domain, Options(), literal, step)
        assert found.holds
        known = [each for _, each in found.reason.walk() if not each.reasons and not each.repeated]
        assert {each.role for each in known} <= {
            Role.KNOWN,
            Role.ABSENT,
            Role.CONDITION,
            Role.ASSUMED,
            Role.CONCLUDED,
        }


def test_where_there_are_several_answer_sets_it_says_so() -> None:
    assert not explain("on(desk)", history=HISTORY).others
    text = LAMP + "estimated fluent dark(lamp). normally dark(L) if on(L). "
    text += "normally -bright(L) if on(L)."
    assert explain("on(desk)", text=text, history=HISTORY).others


@pytest.mark.parametrize(
    ("literal", "step", "error", "words"),
    [
        ("onn(desk)", None, LanguageError, "'onn'"),
        ("on(L)", None, LanguageError, "L"),
        ("on(desk)", 9, ParameterError, "the steps are 0 to 1"),
        ("on(desk)", -1, ParameterError, "the steps are 0 to 1"),
    ],
)
def test_a_wrong_question_is_refused(
    literal: str, step: int | None, error: type[Exception], words: str
) -> None:
    with pytest.raises(error) as caught:
        explain(literal, step, history=HISTORY)
    assert words in str(caught.value)


def test_nothing_is_explained_where_nothing_is_believed() -> None:
    history = f"{HISTORY} obs(on(desk), false, 1)."
    with pytest.raises(ReasoningError, match="no answer set"):
        explain("on(desk)", history=history)


def test_the_command_explains_a_history(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    svg = tmp_path / "why.svg"
    files = [str(path) for path in LIBRARY]
    arguments = ["explain", "at(porter, library)", "--step", "1", "--domain", *files]
    assert main([*arguments, "--svg", str(svg)]) == 0
    out = capsys.readouterr().out
    assert out.startswith("at(porter, library) at step 1 by going: ")
    assert out.endswith("without them the history contradicts the domain.\n")
    assert svg.read_text().startswith("<svg")
    assert main([*arguments, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["holds"], answer["step"], answer["restored"]) == (True, 1, True)
    assert main(["explain", "at(porter, hell)", "--domain", *files]) == 1
    assert "'hell'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--domain", "x.al", "--scene", "x.yaml"], "leave out --scene"),
        (["--scene", "x.yaml", "--step", "1"], "--step belongs to --domain"),
    ],
)
def test_scenes_have_no_steps_and_domains_no_scene(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explain", "stable(a)", *arguments]) == 2
    assert words in capsys.readouterr().err
