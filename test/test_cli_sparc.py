"""`scenesense solve`, `translate` and `query` on SPARC programs, and the page about them."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import clingo
import pytest

from ros_scenesense.cli.main import main
from ros_scenesense.knowledge.sparc.idle import idle_rules
from ros_scenesense.knowledge.sparc.language import parse
from ros_scenesense.knowledge.sparc.translation import translated
from ros_scenesense.reasoning.answer_sets import AnswerSetEngine, Question

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = """\
#const n = 2.
sorts
#s = 1..n. #t = {a, f(b)}.
predicates
p(#s). q(#t).
rules
1{p(X) : #s(X)}1.
q(a). -q(f(b)).
"""


@pytest.fixture
def program(tmp_path: Path) -> str:
    path = tmp_path / "program.sp"
    path.write_text(PROGRAM)
    return str(path)


def test_each_answer_set_on_one_line(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", program, "--lines", "--models", "0"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sorted(lines) == ["{p(1), q(a), -q(f(b))}", "{p(2), q(a), -q(f(b))}"]
    assert main(["solve", program, "--lines", "--models", "0", "-c", "n=1"]) == 0
    assert capsys.readouterr().out.splitlines() == ["{p(1), q(a), -q(f(b))}"]


def test_answers_as_json(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", program, "--json", "-c", "n=1"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["answer_sets"] == [["p(1)", "q(a)", "-q(f(b))"]]


@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        ("q(a)", "yes\n"),
        ("-q(a).", "no\n"),
        ("p(1)", "unknown\n"),
        ("p(X)", "no values\n"),
        ("q(X)", "X = a\n"),
        ("-q(f(X))", "X = b\n"),
        ("-q(_)", "yes\n"),
        ("p(n - 1)", "unknown\n"),
    ],
)
def test_a_query_is_answered(
    asked: str, answer: str, program: str, capsys: pytest.CaptureFixture[str]
) -> None:
    # The tests call `main`; a shell hands over the same words.
    assert main(["query", program, "--", asked]) == 0
    assert capsys.readouterr().out == answer


def test_queries_are_read_line_by_line(
    program: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("q(a)\n\nq(b).\nq(\nexit\nq(a)\n"))
    assert main(["query", program]) == 0
    first, second, third = capsys.readouterr().out.splitlines()
    assert first == "yes"
    assert second.startswith("query:1:3: 'b' in q(b) does not belong to sort '#t'")
    assert third.startswith("query:1:2: found the end of the statement, expected")


def test_only_the_best_answer_sets_count_for_a_query(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "program.sp"
    path.write_text(
        "predicates\na(). b(). c(). d().\nrules\na :+. b :+.\n:- not a, not b.\n"
        "c | d.\n:~ c. [1:]\n:~ b. [2:]\n"
    )
    for asked, answer in (("a", "yes"), ("b", "unknown"), ("d", "yes"), ("c", "unknown")):
        assert main(["query", str(path), asked]) == 0
        assert capsys.readouterr().out == f"{answer}\n"


def test_without_optimisation_cr_rules_stay_few(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "program.sp"
    path.write_text("predicates\na(). b(). c().\nrules\na :+. b :+. {c}.\n:- not a.\n:~ c.\n")
    assert main(["solve", str(path), "--lines", "--models", "0"]) == 0
    assert capsys.readouterr().out.splitlines() == ["{a}"]
    assert main(["solve", str(path), "--lines", "--models", "0", "--no-optimize"]) == 0
    assert sorted(capsys.readouterr().out.splitlines()) == ["{a, c}", "{a}"]


def test_a_translation_is_complete(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["translate", program]) == 0
    control = clingo.Control(["0"])
    control.add(capsys.readouterr().out)
    control.ground()
    assert control.solve().satisfiable


@pytest.mark.parametrize(
    ("content", "arguments", "code", "words"),
    [
        (b"", [], 2, "found no statement"),
        (b"\x00\x01", [], 2, "program.sp:1:1: found the character '\\x00'"),
        (b"\xff\xfe", [], 2, "program.sp:1:1: found the byte 0xFF"),
        (b"predicates\np().\nrules\np(\n", [], 2, "is not ended by a full stop"),
        (b'predicates\np().\nrules\np :- "x.\n', [], 2, "SPARC has no strings"),
        (b"predicates\np().\nrules\np." + b"(" * 5000 + b".", [], 2, "nested more than"),
        (b"predicates\np().\nrules\n:- p, 1" + b"+1" * 5000 + b" < 2.", [], 2, "operators on end"),
        (
            b"sorts\n#a = {x}" + b" - {y}" * 5000 + b".\npredicates\np(#a).\nrules\n",
            [],
            2,
            "operators on end",
        ),
        (
            b"sorts\n#s0 = {x}.\n"
            + b"".join(b"#s%d = #s%d.\n" % (n, n - 1) for n in range(1, 2000)),
            [],
            2,
            "builds on 100 others",
        ),
        (b"predicates\np().\nrules\np. :- p.", [], 1, ""),
        (b"predicates\np().\nrules\np.", ["-c", "n=1"], 2, "there is no constant 'n' to set"),
        (b"predicates\np().\nrules\np.", ["-c", "n=a"], 2, "expected NAME=NUMBER"),
        (
            b"predicates\np(#nat, #nat, #nat).\nrules\np(X, Y, Z).",
            ["--time-limit", "0.3"],
            3,
            "stopped after 0.3 s while the program was grounded",
        ),
        (
            b"#maxint = 9999999.\nsorts\n#s = 1..9999999.\npredicates\np(#s).\nrules\np(X).",
            [],
            2,
            "has up to 9999999 members",
        ),
    ],
)
def test_bad_input_is_told_and_exits(
    content: bytes,
    arguments: list[str],
    code: int,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "program.sp"
    path.write_bytes(content)
    assert main(["solve", str(path), *arguments]) == code
    assert words in capsys.readouterr().err


def test_one_program_is_one_file(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", program, program]) == 2
    assert "expected one: a SPARC program is one file" in capsys.readouterr().err


def test_rules_that_can_never_apply_are_told_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "program.sp"
    path.write_text(
        "#maxint = 1000.\nsorts\n#s = 1..1000. #a = {a}. #b = {b}. #f = f(#a). #g = g(#b).\n"
        "predicates\np(#s). q(#a). r(#b). t(#f). u(#g).\nrules\n"
        "p(X - 600) :- p(X + 600).\nq(X) :- r(X).\nt(g(X)) :- r(X).\np(X) :- p(Y), X = Y + 1.\n"
        "q(X) :- q(X), X != a.\nq(X) :- p(Y), Y > 3, q(X).\n"
    )
    assert main(["solve", str(path), "--warn"]) == 0
    warned = re.findall(r"program\.sp:(\d+):1: this rule can never", capsys.readouterr().err)
    assert warned == ["7", "8", "9", "11"]
    assert main(["solve", str(path)]) == 0
    assert capsys.readouterr().err == ""
    assert list(idle_rules(parse(PROGRAM))) == []


def test_guards_that_conditions_imply_are_left_out() -> None:
    text = """\
sorts
#room = {r1, r2}. #box = {b1}. #step = 0..3.
#fluent = at(#box, #room). #action = carry(#box, #room).
predicates
holds(#fluent, #step). occurs(#action, #step). far(#room).
rules
holds(at(B, R), I + 1) :- occurs(carry(B, R), I).
holds(F, I) :- holds(F, I), not -holds(F, I).
-holds(at(B, R), I) :- holds(at(B, S), I), R != S.
"""
    lines = translated(parse(text)).text.splitlines()
    assert "holds(at(B, R), I + 1) :- occurs(carry(B, R), I), I + 1 = 0..3." in lines
    assert "holds(F, I) :- holds(F, I), not -holds(F, I)." in lines
    assert "-holds(at(B, R), I) :- holds(at(B, S), I), R != S, room(R)." in lines


def test_common_consequences_are_those_of_all_answer_sets() -> None:
    text = "1 {a; b; c} 2. d. e :- a. e :- b. e :- c. #minimize {1 : c; 1, x : d}."
    every = AnswerSetEngine().solve(Question(text=text, models=0))
    (common,) = AnswerSetEngine().consequences(Question(text=text)).sets
    assert set(common) == set.intersection(*map(set, every.sets)) == {"d", "e"}


def test_the_pages_show_what_the_commands_print(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    page, readme = ((ROOT / name).read_text() for name in ("docs/sparc.md", "README.md"))
    example = ROOT / "asp/examples/missing_parcel.sp"
    assert main(["solve", str(example), "--models", "0"]) == 0
    out = capsys.readouterr().out
    assert f"\n```\n{out}```\n" in page
    assert f"--models 0\n{out}```\n" in readme
    assert main(["query", str(example), "holds(loc(parcel, P), 2)"]) == 0
    assert f"it answers `{capsys.readouterr().out.strip()}`" in page
    assert main(["translate", str(example)]) == 0
    (shown,) = re.findall(r"^```\n(holds\(loc.*?)^```$", page, re.DOTALL | re.MULTILINE)
    assert f"\n{shown}" in capsys.readouterr().out
    text = example.read_text()
    for right, wrong in (
        ("holds(loc(R, P), I + 1)", "hold(loc(R, P), I + 1)"),
        ("parcel, office, 3)", "parcel, ofice, 3)"),
        ("I < n", "J < n"),
    ):
        assert text.count(right) == 1
        text = text.replace(right, wrong)
    monkeypatch.chdir(tmp_path)
    Path("missing_parcel.sp").write_text(text)
    assert main(["solve", "missing_parcel.sp"]) == 2
    problems = capsys.readouterr().err.removeprefix("scenesense solve: ")
    assert f"\n```\n{problems}```\n" in page
