"""`scenesense solve` and `scenesense translate`, and the engine that computes answer sets."""

from __future__ import annotations

import json
from pathlib import Path

import clingo
import pytest

from ros_scenesense.cli.main import main
from ros_scenesense.errors import ReasoningError
from ros_scenesense.reasoning.answer_sets import AnswerSetEngine, Outcome, Question
from ros_scenesense.resources import resource

DOMAIN = """\
sort block = {a, b}. inertial fluent clear(block). estimated fluent shaky(block).
action shake(block). exogenous action storm.
shake(B) causes clear(B).
storm causes -clear(B).
normally shaky(B) if clear(B).
initially clear(a), -clear(b). hpd(shake(b), 0).
"""
OPTIMISING = (
    "{a; b; c}. :- not a, not b, not c. #minimize{1,x: a; 1,y: b; 2,z: c}. #show a/0. #show b/0."
)
HARD = "1 {in(P, H) : H = 1..12} 1 :- P = 1..13. :- in(P, H), in(Q, H), P < Q."
ENDLESS = "p(1..100000). q(X, Y, Z) :- p(X), p(Y), p(Z)."


@pytest.fixture
def domain(tmp_path: Path) -> str:
    path = tmp_path / "domain.al"
    path.write_text(DOMAIN)
    return str(path)


def solved(text: str, **options: object) -> tuple[Outcome, list[tuple[str, ...]], bool]:
    answers = AnswerSetEngine().solve(Question(text=text, **options))
    return answers.outcome, sorted(answers.sets), answers.complete


def test_only_optimal_answer_sets_are_answers() -> None:
    found = AnswerSetEngine().solve(Question(text=OPTIMISING, models=0))
    assert (sorted(found.sets), found.costs) == ([("a",), ("b",)], (1,))
    # Those that differ in what is not shown are one: {}, {a}, {b}, {a, b}, with and without c.
    assert solved(OPTIMISING, models=0, optimize=False)[1] == [(), ("a",), ("a", "b"), ("b",)]


@pytest.mark.parametrize(
    ("models", "count", "complete"), [(0, 3, True), (2, 2, False), (3, 3, False)]
)
def test_as_many_answer_sets_as_asked_for(models: int, count: int, complete: bool) -> None:
    outcome, sets, ended = solved("1 {a; b; c} 1.", models=models)
    assert (outcome, len(sets), ended) == (Outcome.SATISFIABLE, count, complete)
    assert (
        len(solved("{c}. 1 {a; b} 1. :~ a. [1] :~ b. [1] #show a/0. #show b/0.", models=2)[1]) == 2
    )


def test_a_program_without_answer_set_and_one_that_takes_too_long() -> None:
    assert solved("a. :- a.") == (Outcome.UNSATISFIABLE, [], True)
    assert solved(HARD, time_limit_s=0.2)[0] is Outcome.TIMED_OUT
    assert solved("n(n). #const n = 1.", constants=("n=7",))[1] == [("n(7)",)]


def test_literals_stand_in_the_order_of_terms_whatever_came_first() -> None:
    _, sets, _ = solved("p(1..11). {q(f(2)); -q(f(10)); q(a)}. :- not q(a).", models=0)
    numbers = tuple(f"p({number})" for number in range(1, 12))
    assert sets == [
        (*numbers, "q(a)"),
        (*numbers, "q(a)", "-q(f(10))"),
        (*numbers, "q(a)", "q(f(2))"),
        (*numbers, "q(a)", "q(f(2))", "-q(f(10))"),
    ]


def test_what_was_found_in_time_is_kept() -> None:
    outcome, sets, complete = solved("{p(1..60)}.", models=0, time_limit_s=0.3)
    assert (outcome, complete) == (Outcome.TIMED_OUT, False)
    assert len(sets) == len(set(sets)) > 0


def test_cr_rules_come_in_only_where_there_is_no_answer_set_without_them() -> None:
    """The program of CR-Prolog whose smallest set of rules is {a}, though {b, c} restores too."""
    text = """#const restore = 1.
        {applied(a); applied(b); applied(c)} :- restore = 1.
        a :- applied(a). b :- applied(b). c :- applied(c).
        ok :- b, c. :- not a, not ok.
        #minimize {1@1000, R : applied(R)}. #show a/0. #show b/0. #show c/0."""
    answers = AnswerSetEngine().solve(Question(text=text, restoring=True, models=0))
    assert (answers.sets, answers.restored) == ((("a",),), True)
    answers = AnswerSetEngine().solve(Question(text=text + "b. c.", restoring=True, models=0))
    assert (answers.sets, answers.restored) == ((("b", "c"),), False)
    answers = AnswerSetEngine().solve(Question(text=text + ":- a. :- b.", restoring=True))
    assert (answers.outcome, answers.restored) == (Outcome.UNSATISFIABLE, False)


def test_a_broken_program_is_told_with_its_place() -> None:
    with pytest.raises(ReasoningError, match=r"program:1:8-9: error: syntax error"):
        solved("a :- b c.")


def test_a_domain_is_solved_step_by_step(domain: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", domain, "--models", "0"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "answer set 1",
        "    0  clear(a), shaky(a)",
        "       does shake(b)",
        "    1  clear(a), clear(b), shaky(a), shaky(b)",
        "There are no more.",
    ]


def test_files_go_on_from_the_domain_and_answers_are_json(
    domain: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seen = tmp_path / "seen.al"
    seen.write_text("obs(clear(a), false, 1). obs(shaky(a), false, 0).")
    assert main(["solve", domain, str(seen), "--json", "--models", "0"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert (answer["outcome"], answer["answer_sets"]) == ("unsatisfiable", [])
    # Nothing was done to b, so the storm explains it; and a is an exception.
    still = tmp_path / "still.al"
    still.write_text(DOMAIN.replace("hpd(shake(b), 0).", seen.read_text()))
    assert main(["solve", str(still), "--json", "--models", "0"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["answer_sets"] == [
        [
            "applied(event(storm),0)",
            "applied(exception(shaky_1(a)),0)",
            "holds(clear(a),0)",
            "occurs(storm,0)",
            "-holds(shaky(a),0)",
        ]
    ]
    assert (answer["complete"], answer["cr_rules"], answer["costs"]) == (True, True, [2])


def test_a_program_is_solved_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "program.lp"
    path.write_text('#const n = 1. p(n, "a,b(c d"). -q. {r}.')
    assert main(["solve", str(path), "-c", "n=3", "--models", "0"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert sorted(out[1:4:2]) == ['  {-q, p(3, "a,b(c d")}', '  {r, -q, p(3, "a,b(c d")}']


@pytest.mark.parametrize(
    ("name", "text", "arguments", "words"),
    [
        ("none.lp", None, [], "none.lp cannot be read: No such file"),
        ("none.al", None, [], "none.al cannot be read: No such file"),
        ("zero.lp", "a.\n\0", [], "zero.lp:2: found a zero byte"),
        ("bad.al", "sort x", [], "bad.al:1:1: this statement is not ended"),
        ("bad.txt", "a.", [], "found files of kind .txt"),
        ("a.lp", "a.", ["-c", "n=1)."], "expected NAME=VALUE"),
        ("a.lp", "a.", ["--models", "-1"], "must be an integer of at least 0"),
        ("a.lp", "a.", ["--time-limit", "never"], "must be a number from 0.01"),
        ("a.al", "inertial fluent p.", ["--without", "x"], "has no axiom x"),
        ("a.al", "inertial fluent p.", ["--steps", "x"], "'--steps' is 'x', must be an integer"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(
    name: str,
    text: str | None,
    arguments: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    assert main(["solve", str(path), *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert words in captured.err
    assert captured.err.count("\n") == 1


def test_a_mistake_of_a_program_is_told_with_its_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.lp"
    path.write_text("a :- b\nc.")
    assert main(["solve", str(path)]) == 2
    assert f"{path}:2:1-2: error: syntax error" in capsys.readouterr().err


def test_grounding_without_end_is_stopped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "endless.lp"
    path.write_text(ENDLESS)
    assert main(["solve", str(path), "--time-limit", "0.3"]) == 3
    assert "stopped after 0.3 s while the program was grounded" in capsys.readouterr().err


def test_grounding_without_bounds_is_stopped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "endless.lp"
    path.write_text(ENDLESS)
    assert main(["solve", str(path), "--memory-limit", "0.3"]) == 2
    assert "needs more than 0.3 GiB of memory" in capsys.readouterr().err


def test_a_translation_is_printed_or_written(
    domain: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["translate", domain, "--steps", "3", "--show-all"]) == 0
    program = capsys.readouterr().out
    control = clingo.Control(["0"])
    control.add(program)
    control.ground()
    assert control.solve().satisfiable
    assert "#const steps = 3." in program
    assert "#show -holds/2." in program
    written = tmp_path / "out.lp"
    arguments = ["translate", domain, "--without", "shaky_1", "--output", str(written)]
    assert main(arguments) == 0
    assert "shaky_1" not in written.read_text()
    assert "shaky_1" in program
    assert main(["translate", str(tmp_path / "none.al")]) == 2
    assert "cannot be read" in capsys.readouterr().err


def test_the_domain_of_the_paper_can_be_translated(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["translate", str(resource("asp", "robot_assistant.al"))]) == 0
    assert "holds(below(B, A), I) :- holds(above(A, B), I)." in capsys.readouterr().out
