from __future__ import annotations

from pathlib import Path

import pytest

from ros_scenesense.errors import ReasoningError
from ros_scenesense.reasoning.program import Program
from ros_scenesense.scene import Task

AXIOM = """
#defined enabled/1.
#defined surveyed/1.
axiom(a1, normal, "Everything is stable.").
pos(stable(A), a1) :- enabled(a1), surveyed(A).
"""


@pytest.fixture(scope="module")
def shipped() -> Program:
    return Program.shipped()


def test_the_shipped_program_declares_the_axioms_of_the_domain(shipped: Program) -> None:
    assert [(axiom.id, axiom.kind, axiom.task) for axiom in shipped.axioms] == [
        ("large_on_small", "default", Task.STABILITY),
        ("tall_tower", "default", Task.STABILITY),
        ("s1", "normal", Task.STABILITY),
        ("s2", "normal", Task.STABILITY),
        ("s3", "default", Task.STABILITY),
        ("o1", "normal", Task.OCCLUSION),
        ("o2", "default", Task.OCCLUSION),
        ("o3", "default", Task.OCCLUSION),
    ]
    assert shipped.axioms[2].text == "An object that is above no other object is stable."


def test_facts_that_no_axiom_needs_are_not_asked_for(shipped: Program) -> None:
    names = {name for name, _ in shipped.used}
    assert {"above", "below", "behind", "front", "touching", "size", "surface"} <= names
    assert names.isdisjoint({"left", "right", "far", "not_touching", "in"})


def test_a_relation_is_asked_for_once_an_axiom_needs_it() -> None:
    rule = (
        'axiom(a2, default, "x"). neg(occluded(A), a2) :- enabled(a2), left(A, _).'
        "left(A, B) :- right(B, A). #defined right/2. far(A, B) :- far(B, A)."
    )
    assert {("left", 2), ("right", 2)} <= Program(AXIOM + rule).used
    assert ("far", 2) not in Program(AXIOM + rule).used


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("a.\npos(stable(A), s1 :- b(A).", "2:19", "unexpected :-"),
        ("a.\n  b(A) :- not a.", "2:3", "'A' is unsafe"),
        (AXIOM + "neg(stable(A), a1) :- enabled(a1), abov(A, _).", "6:36", "abov"),
        ("#defined enabled/1.\npos(stable(1), a1) :- enabled(a1).", "2:1", "not declared"),
        (AXIOM + "neg(stable(A), a1) :- surveyed(A).", "6:1", "enabled(a1)"),
        (AXIOM + "neg(wet(A), a1) :- enabled(a1), surveyed(A).", "6:1", "'wet' is no fluent"),
        (AXIOM + "pos(stable(A,A),a1) :- enabled(a1), surveyed(A).", "6:1", "'stable(A,A)'"),
        ("a.\n\0b.", "2", "zero character"),
    ],
)
def test_a_broken_program_is_refused_with_its_place(
    text: str, place: str, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ReasoningError) as caught:
        Program(text, "domain.lp")
    assert f"domain.lp:{place}" in str(caught.value)
    assert words in str(caught.value)
    assert "<string>" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (AXIOM + 'axiom(a1, default, "again").', "must be the only"),
        (AXIOM + 'axiom(a2, perhaps, "x").', "normal | default"),
        (AXIOM + "axiom(a2, normal, words).", '"in words"'),
        (AXIOM + 'axiom(a2, normal, "No rule.").', "0 fluents"),
        (AXIOM + "neg(occluded(A), a1) :- enabled(a1), surveyed(A).", "2 fluents"),
    ],
)
def test_a_wrong_declaration_is_refused(text: str, words: str) -> None:
    with pytest.raises(ReasoningError) as caught:
        Program(text, "domain.lp")
    assert "domain.lp" in str(caught.value)
    assert words in str(caught.value)


def test_a_missing_or_unreadable_file_is_named(tmp_path: Path) -> None:
    missing = tmp_path / "none.lp"
    with pytest.raises(ReasoningError, match=r"none\.lp cannot be read"):
        Program.load(missing)
    binary = tmp_path / "binary.lp"
    binary.write_bytes(b"a. \xff\xfe")
    with pytest.raises(ReasoningError, match=r"binary\.lp cannot be read"):
        Program.load(binary)


def test_a_missing_installation_is_a_reasoning_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ros_scenesense.resources._PACKAGE", Path("/nowhere/package"))
    with pytest.raises(ReasoningError, match="reinstall"):
        Program.shipped()


def test_the_revision_changes_with_the_knowledge_in_force_only(shipped: Program) -> None:
    text = Program(AXIOM)
    revision = text.revision()
    assert Program("% a comment\n" + AXIOM.replace(", surveyed", ",\n  surveyed")).revision() == (
        revision
    )
    assert Program(AXIOM + "far(A, B) :- far(B, A).").revision() == revision
    assert Program(AXIOM.replace("Everything", "All")).revision() != revision
    assert Program(AXIOM.replace("normal", "default")).revision() != revision
    assert Program(AXIOM.replace("surveyed(A)", "surveyed(A), A > 1")).revision() != revision
    other = 'axiom(a2, default, "x"). neg(stable(A), a2) :- enabled(a2), surveyed(A).'
    assert Program(AXIOM + other).revision() != revision
    assert Program(AXIOM + other).revision(["a2"]) == revision

    ids = [axiom.id for axiom in shipped.axioms]
    revisions = {shipped.revision(ids[:count]) for count in range(len(ids) + 1)}
    assert len(revisions) == len(ids) + 1
