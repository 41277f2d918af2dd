from __future__ import annotations

import gc
import weakref
from pathlib import Path

import pytest

from ros_scenesense.errors import LanguageError, ReasoningError
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.classification import ClassificationRule
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.reasoning.program import Axiom, Program
from ros_scenesense.scene import Task

DOMAIN = """
sort object.
sort size = {small, large}.
inertial fluent above(object, object), left(object, object), right(object, object),
    far(object, object).
static obj_size(object, size).
estimated fluent stable(object), occluded(object), wet(object).
"""


def description(text: str = "") -> SystemDescription:
    return parse(DOMAIN + text, "domain.al").description


@pytest.fixture(scope="module")
def shipped() -> Program:
    return Program.shipped()


def used_by(program: Program, *withheld: str) -> set[str]:
    return {name for name, _ in program.selection(frozenset(withheld)).used}


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
    needed = {"above", "below", "behind", "front", "touching", "in", "obj_size", "obj_surface"}
    assert needed <= used_by(shipped)
    assert used_by(shipped).isdisjoint({"left", "right", "far", "not_touching"})
    assert used_by(shipped, "o1", "o2", "o3").isdisjoint({"behind", "front"})
    assert "obj_surface" not in used_by(shipped, "s2")


def test_a_relation_is_asked_for_once_an_axiom_needs_it() -> None:
    rules = "far(A, B) if far(B, A). left(A, B) if right(B, A)."
    assert used_by(Program.of(description(rules))).isdisjoint({"left", "right", "far"})
    rules += "a2: normally -occluded(A) if left(A, B)."
    program = Program.of(description(rules))
    assert {"left", "right"} <= used_by(program)
    assert "far" not in used_by(program)
    assert used_by(program, "a2").isdisjoint({"left", "right", "far"})


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("a. pos(stable(A), s1 :- b(A).", "1:22", "unexpected :-"),
        ("a.\n\0b.", "2", "zero character"),
    ],
)
def test_a_broken_rule_is_refused_with_its_place(
    text: str, place: str, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ReasoningError) as caught:
        Program([ClassificationRule(text)], [], "domain.lp")
    assert f"domain.lp:{place}" in str(caught.value)
    assert words in str(caught.value)
    assert "<string>" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_name_that_the_program_needs_itself_is_refused() -> None:
    with pytest.raises(ReasoningError) as caught:
        Program.of(description("estimated fluent possible(object)."))
    assert "domain.al:8:18: 'possible'" in str(caught.value)


def test_a_missing_installation_is_a_reasoning_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ros_scenesense.resources._PACKAGE", Path("/nowhere/package"))
    with pytest.raises(ReasoningError, match="reinstall"):
        Program.shipped()


def test_other_estimated_fluents_decide_nothing() -> None:
    program = Program.of(description("w: wet(A) if left(A, B). s: stable(A) if wet(A)."))
    assert program.axioms == (
        Axiom("s", "normal", "stable(A) if wet(A).", Task.STABILITY, "wet({})"),
    )
    assert "left" in used_by(program)


def test_the_revision_changes_with_the_knowledge_in_force_only(shipped: Program) -> None:
    rule = 'a1 "Everything is stable.": stable(A) if above(A, B).'

    def revision(text: str, *withheld: str) -> str:
        return Program.of(description(text)).revision(withheld)

    assert revision("% a comment\n" + rule.replace(" if", "\n   if")) == revision(rule)
    assert revision(rule + "far(A, B) if far(B, A).") == revision(rule)
    assert revision(rule.replace("Everything", "All")) != revision(rule)
    assert revision(rule.replace("stable(A) if", "normally stable(A) if")) != revision(rule)
    assert revision(rule.replace("if", "if left(A, B),")) != revision(rule)
    other = rule + "a2: normally -stable(A) if left(A, B)."
    assert revision(other) != revision(rule)
    assert revision(other, "a2") == revision(rule)

    ids = [axiom.id for axiom in shipped.axioms]
    revisions = {shipped.revision(ids[:count]) for count in range(len(ids) + 1)}
    assert len(revisions) == len(ids) + 1


def test_learned_axioms_are_added_and_removed(shipped: Program) -> None:
    text = "normally occluded(A) if behind(A, B), obj_size(B, large)."
    extended = shipped.extended({"l1": text})
    assert extended.axioms[-1] == Axiom(
        "l1", "default", text, Task.OCCLUSION, "behind({}, B), obj_size(B, large)"
    )
    assert extended.revision() != shipped.revision()
    assert extended.revision(["l1"]) == shipped.revision()
    assert extended.without(["l1"]).revision() == shipped.revision()


@pytest.mark.parametrize(
    ("identifier", "text", "words"),
    [
        ("s1", "stable(A).", "already"),
        ("l1", "stabel(A) if on(A, table).", "stable"),
        ("l1", "stable(A) if on(A, B). occluded(A).", "nothing else"),
        ("l1", "stable(A) if on(A, B). sort extra.", "nothing else"),
        ("l1", "pickup(R, A) causes stable(A).", "axiom l1"),
        ("l1", "initially normally stable(A) if on(A, B).", "expected `l if ...`"),
        ("l1", "pos(stable(A)) :- a.", "axiom l1:1"),
        ("l1", "", "axiom l1"),
        ("a). bad(", "stable(A) if on(A, B).", "is no name"),
        ("l1", "obj_size(a, b).", "axiom l1"),
    ],
)
def test_a_wrong_learned_axiom_is_refused(
    shipped: Program, identifier: str, text: str, words: str
) -> None:
    with pytest.raises(LanguageError) as caught:
        shipped.extended({identifier: text})
    assert words in str(caught.value)


def test_a_program_is_freed_when_nobody_needs_it_any_more(shipped: Program) -> None:
    extended = shipped.extended({"l1": "occluded(A) if behind(A, B)."})
    extended.selection(frozenset())
    alive = weakref.ref(extended)
    gc.disable()
    try:
        del extended
        assert alive() is None
    finally:
        gc.enable()
