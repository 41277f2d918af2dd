"""docs/action_language.md: its examples work, and its outputs are what the commands print."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ros_scenesense.cli.main import main
from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.action_language import load, parse
from ros_scenesense.knowledge.translation import translate
from ros_scenesense.resources import resource

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs/action_language.md").read_text()
README = (ROOT / "README.md").read_text()
LIBRARY = resource("asp", "examples/library.al")


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)


def test_the_examples_are_a_domain_that_works() -> None:
    domain = parse("\n".join(blocks("al")), "docs/action_language.md")
    assert domain.history.last_step == 2
    assert {"s1", "s2", "large_on_small", "on_1"} <= set(domain.description.ids)
    assert "holds(in_hand(R, A), I + 1) :- occurs(pickup(R, A), I), I < steps." in translate(
        domain.description, domain.history
    )


def test_the_morning_in_the_library_is_explained_as_the_page_says(
    capsys: pytest.CaptureFixture[str],
) -> None:
    day = resource("asp", "examples/library_day.al")
    assert main(["solve", str(LIBRARY), str(day), "--models", "0"]) == 0
    out = capsys.readouterr().out
    assert f"\n```\n{out}```\n" in PAGE
    # The first page shows the end of it.
    assert f"\n...\n{out[out.index('    2  ') :]}```\n" in README


def test_the_first_page_shows_a_rule_of_the_translation(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["translate", str(LIBRARY)]) == 0
    (shown,) = re.findall(r"^```\n(% going .*?)^```$", README, re.DOTALL | re.MULTILINE)
    assert f"\n{shown}\n" in capsys.readouterr().out


def test_mistakes_are_told_as_the_page_says() -> None:
    text = LIBRARY.read_text()
    for right, wrong in (
        ("stuck(R) if at(R, P), not way", "stuck(R) if at(R, ofice), at(R, P), not wy"),
        ("Q), open(D).", "Q), N > 1."),
    ):
        assert right in text
        text = text.replace(right, wrong)
    with pytest.raises(LanguageError) as caught:
        parse(text, "library.al")
    assert f"\n```\n{caught.value}\n```\n" in PAGE


def test_the_python_example_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    (example,) = blocks("python")
    names: dict[str, str] = {}
    monkeypatch.chdir(LIBRARY.parent.parent.parent)
    exec(example, names)
    assert "hpd(go(porter, library), 0)." in names["program"]
    assert "quiet_library" not in names["program"]


def test_the_table_of_the_robots_domain_is_what_the_file_says() -> None:
    description = load(resource("asp", "robot_assistant.al")).description
    rows = re.findall(
        r"^\| `(\w+)` \| ([\w ]+) \| (.*?) \| (given|withheld) \|$", PAGE, re.MULTILINE
    )
    assert len(rows) == 9
    for identifier, kind, text, known in rows:
        (axiom,) = description.axioms_of(identifier)
        prefix = {"normal": "", "default": "normally ", "initial default": "initially normally "}
        assert str(axiom) == f"{prefix[kind]}{text}."
        assert axiom.withheld == (known == "withheld")
