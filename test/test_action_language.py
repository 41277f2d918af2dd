from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.action_language import (
    Domain,
    load,
    parse,
    parse_goal,
    parse_literal,
)
from ros_scenesense.knowledge.axioms import CausalLaw, Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.knowledge.writing import written
from ros_scenesense.resources import resource

DECLARED = """\
sort object = {can, duck}. sort robot = {rob1}. sort location = object + {table}.
const top = 8. sort level = 1..top. sort colour = {red, green}. sort open.
static colour_of(object, colour).
inertial fluent above(object, object), in_hand(robot, object), lies(object, location).
defined fluent height(object, level), high(object).
estimated fluent stable(object), shiny(open).
action pickup(robot, object). exogenous action fall(object).
"""
LINE = DECLARED.count("\n") + 1


@pytest.fixture(scope="module")
def robot_assistant() -> Domain:
    return load(resource("asp", "robot_assistant.al"))


@pytest.fixture(scope="module")
def scene(robot_assistant: Domain) -> SystemDescription:
    objects = [Constant("red_can"), Constant("white_cube")]
    return robot_assistant.description.with_members("object", objects)


def problems(text: str) -> list[str]:
    with pytest.raises(LanguageError) as caught:
        parse(text, "t.al")
    return str(caught.value).splitlines()


def test_the_domain_of_the_paper_is_given_and_withheld(robot_assistant: Domain) -> None:
    description = robot_assistant.description
    withheld = [axiom for axiom in description.axioms if axiom.withheld]
    assert [(axiom.id, axiom.kind, str(axiom)) for axiom in withheld] == [
        ("s1", "normal", "stable(A) if not above(A, B)."),
        ("s2", "normal", "-stable(A) if irregular_below(A)."),
        ("s3", "default", "normally -stable(A) if small_base(A)."),
        ("o1", "normal", "-occluded(A) if not behind(A, B)."),
        ("o2", "default", "normally -occluded(A) if behind(A, B), above(A, C)."),
        ("o3", "default", "normally occluded(A) if behind(A, B), not above(A, C)."),
    ]
    assert {"large_on_small", "tall_tower", "four_blocks", "on_object"} <= set(description.ids)
    assert all(each.words for each in withheld)
    (goal,) = description.goals.values()
    assert str(goal) == "no occluded(X), no -stable(X), no in_hand(R, X), fewest on(X, table)"


def test_the_converse_laws_are_the_papers_action_language(robot_assistant: Domain) -> None:
    """Statements (b) and (c): the paper's printed program reverses them."""
    laws = {axiom.id: str(axiom) for axiom in robot_assistant.description.axioms}
    assert laws["below_above"] == "below(B, A) if above(A, B)."
    assert laws["behind_front"] == "behind(B, A) if front(A, B)."


def test_axioms_are_switched_off_by_name(robot_assistant: Domain) -> None:
    description = robot_assistant.description
    assert len(description.axioms_of("pickup_leaves")) == 20
    rest = description.without({"pickup_leaves", "s1"})
    assert len(rest.axioms) == len(description.axioms) - 21
    assert "s1" not in rest.ids


def test_every_axiom_is_read_again_from_what_it_prints(robot_assistant: Domain) -> None:
    description = robot_assistant.description
    text = "\n".join(str(axiom) for axiom in description.axioms)
    again = parse(text, "again", description.without(description.ids)).description
    assert [str(each) for each in again.axioms] == [str(each) for each in description.axioms]
    for axiom, read in zip(description.axioms, again.axioms, strict=True):
        assert (type(axiom), axiom.premises, axiom.conclusions) == (
            type(read),
            read.premises,
            read.conclusions,
        )


def test_what_is_written_is_read_again(robot_assistant: Domain) -> None:
    description = robot_assistant.description
    text = written(description.axioms)
    assert max(map(len, text.splitlines())) <= 100
    empty = description.without(description.ids)
    assert parse(text, "again", empty).description.axioms == description.axioms
    odd = replace(description.axioms_of("s2")[0], words='say "no"\nto % that\0.')
    (read,) = parse(written([odd]), "odd", empty).description.axioms
    assert read == replace(odd, words="say 'no' to % that .")


def test_a_text_goes_on_from_a_description(scene: SystemDescription) -> None:
    history = """
        sort object += {duck}.
        obj_surface(duck, irregular).
        initially above(duck, red_can).
        hpd(pickup(rob1, duck), 0). obs(in_hand(rob1, duck), true, 1).
        learned "words": normally -stable(A) if above(A, _), not behind(A, _).
    """
    domain = parse(history, "history.al", scene)
    assert domain.history.last_step == 1
    assert [str(each) for each in domain.history.observations] == [
        "obs(in_hand(rob1, duck), true, 1)."
    ]
    assert [str(each) for each in domain.description.facts] == ["obj_surface(duck, irregular)"]
    learned = domain.description.axioms[-1]
    assert isinstance(learned, Default)
    # `_` is a variable of its own in each place.
    assert str(learned) == "normally -stable(A) if above(A, X), not behind(A, Y)."
    assert (learned.id, learned.words) == ("learned", "words")
    assert Constant("duck") in domain.description.signature.members("location")


def test_axioms_without_a_name_are_called_after_what_they_are_about() -> None:
    text = "stable(A) if high(A). high(A) if lies(A, table). pickup(R, A) causes in_hand(R, A)."
    text += (
        "impossible pickup(R, A) if in_hand(R, B). stable_2: stable(A). stable(A) if not high(A)."
    )
    ids = parse(DECLARED + text).description.ids
    assert ids == (
        "stable_1",
        "high_1",
        "pickup_causes_1",
        "impossible_pickup_1",
        "stable_2",
        "stable_3",
    )


def test_constants_numbers_and_arithmetic_are_computed() -> None:
    text = "const low = top / 3 - 4. sort depth = low..-1. stable(A) if height(A, N), N * 2 > -low."
    text += "const tint = red. colour_of(can, tint)."
    description = parse(DECLARED + text).description
    assert description.signature.sorts["depth"].bounds == (-2, -1)
    assert str(description.axioms[0]) == "stable(A) if height(A, N), N * 2 > 0 - -2."
    assert str(description.facts[0]) == "colour_of(can, red)"


def test_statements_stand_in_any_order_and_layout() -> None:
    text = 'x\n "it is": % comment. "\n stable(A)\r\n\tif not\nabove(A,_)% no stop here\n.'
    description = parse(text + DECLARED).description
    assert isinstance(description.axioms[0], StateConstraint)
    assert description.axioms[0].words == "it is"


def test_one_statement_of_several_effects_is_several_laws_of_one_name() -> None:
    text = "take: pickup(R, A) causes in_hand(R, A), -lies(A, L) if lies(A, L), not fall(A)."
    laws = parse(DECLARED + text).description.axioms_of("take")
    assert [str(law) for law in laws if isinstance(law, CausalLaw)] == [
        "pickup(R, A) causes in_hand(R, A) if lies(A, L), not fall(A).",
        "pickup(R, A) causes -lies(A, L) if lies(A, L), not fall(A).",
    ]


@pytest.mark.parametrize(
    ("text", "column", "words"),
    [
        # Syntax.
        ("stable(A) if ,.", 14, "found ',', expected a term or 'not'"),
        ("stable(A if high(A).", 10, "found 'if', expected ')'"),
        ("sort x = .", 10, "found the end of the statement, expected '-', '{', a name or a number"),
        ("stable(A) cuases x.", 11, "did you mean 'causes'?"),
        ("imposible pickup(R, A).", 11, "found 'pickup'"),
        ("stable(A) if high(A)", 1, "not ended by a full stop"),
        ("high(can).. stable(can).", 10, "found '..'"),
        ('x "words: stable(A).', 3, "not closed on this line"),
        ("stable(é).", 8, "found the character 'é' (U+00E9)"),
        ("stable(A) ; high(A).", 11, "found the character ';'"),
        (".", 1, "without a statement"),
        # Declarations.
        ("sort object.", 6, "declared twice; it was declared at t.al:1:6"),
        ("sort robot.", 6, "declared twice"),
        ("inertial fluent pickup(object).", 17, "declared twice"),
        ("static holds(object).", 8, "'holds' means something"),
        ("static of(colr).", 11, "'colr' is no sort; did you mean 'colour'?"),
        ("sort x < y.", 10, "'y' is no sort"),
        ("sort x < x.", 6, "'x' is below itself: x < x"),
        ("sort x = {}.", 6, "is empty"),
        ("sort x = 3..1.", 10, "upside down"),
        ("sort x = 1..tip.", 13, "found 'tip', expected a number or a const; did you mean 'top'?"),
        ("sort x = 1..2 + 4..5.", 17, "two ranges"),
        ("sort x = {A}.", 11, "found the variable A"),
        ("sort objct += {x}.", 6, "did you mean 'object'?"),
        ("const x = 1 / 0.", 11, "has no value"),
        ("const x = 2147483647 + 1.", 11, "has no value of at most 2147483647"),
        ("const x = 99999999999999999999999.", 11, "found the number 99999999999999999999"),
        # Names, arguments, sorts.
        ("stabel(A) if high(A).", 1, "'stabel' is no fluent or static; expected a fluent or a "),
        ("stable(A) if pickup(rob1, A).", 14, "'pickup' is an action"),
        ("above(A, B) causes lies(A, table).", 1, "'above' is a fluent; expected an action"),
        ("picup(A) causes in_hand(R, A).", 1, "no action; expected an action; did you mean 'pick"),
        ("stable(A) if above(A).", 14, "found 1 arguments of 'above', expected 2: above(object, "),
        ("stable(A) if lies(A, tabel).", 22, "did you mean 'table'?"),
        (
            "stable(A) if above(A, table).",
            23,
            "does not belong to sort 'object' ('can' and 'duck')",
        ),
        ("stable(A) if height(A, 9).", 24, "'9' in height(A, 9) does not belong to sort 'level' ("),
        ("shiny(x).", 7, "no members: add some with 'sort open += {...}.'"),
        ("stable(A) if lies(A, f(A)).", 22, "has no such member f(...)"),
        ("stable(A) if above(A, 1 + 1).", 23, "sort 'object' has no numbers"),
        (
            "stable(A) if in_hand(A, A).",
            8,
            "sort 'object' and to sort 'robot', which have no member",
        ),
        ("stable(3).", 8, "'3' in stable(3) does not belong"),
        ("3 if high(can).", 1, "found 3, expected a literal"),
        ("--high(can).", 3, "found two minus signs"),
        # Variables and numbers.
        ("stable(A) if N > 3.", 14, "N is unsafe"),
        ("stable(A) if not height(A, N + 1).", 28, "N is unsafe"),
        ("stable(A) if not above(A, B), not lies(B, _).", 27, "several conditions with 'not'"),
        ("stable(A) if A > 3.", 14, "only numbers can be compared with '>'"),
        ("stable(A) if height(A, N), N * 900000000 > 3.", 28, "as large as 7200000000"),
        ("stable(A) if height(A, N), A + N > 3.", 28, "found A in A + N, expected a number"),
        ("stable(A) if not N = 3.", 18, "expected the opposite operator"),
        # What statements are about.
        ("pickup(R, A) causes stable(A).", 21, "estimated fluent; expected an inertial fluent"),
        ("-high(A) if stable(A).", 2, "'high' is defined, and false wherever nothing derives it"),
        ("normally above(A, B).", 10, "is written 'initially normally ...'"),
        ("colour_of(A, red) if high(A).", 22, "'high' is a defined fluent; expected statics alone"),
        ("impossible high(A).", 12, "'high' is a fluent; expected an action"),
        ("above(can, duck).", 1, "expected 'initially above(can, duck).'"),
        ("x: stable(A). x: stable(A).", 15, "an axiom 'x' stands at"),
        # History and goals.
        ("obs(-stable(can), true, 0).", 6, "written obs(fluent, false, step)"),
        ("obs(stable(A), true, 0).", 12, "found the variable A in an observation"),
        ("obs(stable(can), true, -1).", 5, "found step -1"),
        ("obs(stable(can), true, can).", 24, "found can, expected the number of a step"),
        ("obs(colour_of(can, red), true, 0).", 5, "expected a fluent, or the fact"),
        ("hpd(pickup(rob1, A), 0).", 18, "found the variable A"),
        ("initially stable(can).", 11, "expected an inertial fluent with 'initially'"),
        ("goal g: stable(X).", 16, "which X is meant?"),
        ("goal g: no stable(X). goal g: no high(X).", 28, "defined already"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(text: str, column: int, words: str) -> None:
    found = problems(DECLARED + text)
    assert len(found) == 1, found
    assert found[0].startswith(f"t.al:{LINE}:{column}: "), found
    assert words in found[0]


def test_all_problems_of_a_text_come_at_once_in_its_order() -> None:
    text = "sort x = .\nstabel(A) if high(A).\nstable(A) if N > 3.\nstatic s(objct).\ns(q) if s(q)."
    found = problems(DECLARED + text)
    assert [each.split(":")[1] for each in found] == [str(LINE + line) for line in range(4)]


def test_a_missing_full_stop_hides_nothing_that_follows() -> None:
    found = problems(
        DECLARED + "stable(A) if high(A)\nshiny(B) if\nstable(A).\nsort size.\nhihg(can)."
    )
    assert [each.split(": ")[0] for each in found] == [f"t.al:{LINE + 1}:1", f"t.al:{LINE + 4}:1"]
    assert "is a full stop missing before it?" in found[0]
    assert "hihg" in found[1]
    found = problems(DECLARED + "stable(A) if if\nsort size.\nhihg(can) if size(can).")
    assert len(found) == 2


def test_what_a_statement_that_cannot_be_read_declares_is_not_reported_as_unknown() -> None:
    found = problems(DECLARED + "static weight(object level).\nstable(A) if weight(A, 3).")
    assert len(found) == 1
    assert "found 'level'" in found[0]


def test_many_problems_are_counted() -> None:
    found = problems(DECLARED + "\n".join(f"no_{number}(A)." for number in range(80)))
    assert len(found) == 51
    assert found[-1] == "and 30 more problems"
    # A text that is something else altogether does not keep anybody waiting.
    assert problems("a b.\n" * 100_000)[-1] == "and 950 more problems"


@pytest.mark.parametrize("text", ["", "  \n", "% only words\n"])
def test_a_text_without_statements_is_refused(text: str) -> None:
    assert problems(text) == [
        "t.al:1:1: found no statement; expected sorts, fluents, axioms",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "stable(" * 5000 + "can" + ")" * 5000 + ".",
        "stable(A) if height(A, " + "+".join("1" * 5000) + ").",
        "x" * 100_000 + ".",
        f"{'x' * 1000}: stable(A).",
        "stable(A) if " + "-" * 5000 + "high(A).",
        "\0.",
        "(" * 10_000,
        "stable(A) if " + "[" * 10_000,
        "stable(A) if if\n" * 5_000,
    ],
)
def test_malicious_texts_are_refused_with_short_words(text: str) -> None:
    for problem in problems(DECLARED + text):
        assert len(problem) < 400


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "domain.al"
    with pytest.raises(LanguageError, match="cannot be read: No such file"):
        load(path)
    path.write_bytes(b"sort x.\nsort \xff.")
    with pytest.raises(LanguageError, match=r"domain.al:2:6: found the byte 0xFF"):
        load(path)


def test_goals_are_read_with_the_objects_of_the_scene(scene: SystemDescription) -> None:
    goal = parse_goal("on(red_can, white_cube), no occluded(X), all stable(X).", scene)
    assert str(goal) == "on(red_can, white_cube), no occluded(X), all stable(X)"
    assert parse_goal(" reduce_clutter ", scene) is scene.goals["reduce_clutter"]
    with pytest.raises(LanguageError, match=r"goal:1:4: 'red_cam' in .* did you mean 'red_can'"):
        parse_goal("on(red_cam, white_cube)", scene)
    with pytest.raises(LanguageError, match="goal:1:1: found nothing"):
        parse_goal("", scene)
    with pytest.raises(LanguageError, match="goal:1:4: found 'if'"):
        parse_goal("on if x", scene)
    with pytest.raises(LanguageError, match="found more text after the full stop"):
        parse_goal("no stable(X). on(red_can, table)", scene)


def test_a_literal_is_read_alone(scene: SystemDescription) -> None:
    literal = parse_literal("-stable(red_can)", scene)
    assert (str(literal), literal.positive) == ("-stable(red_can)", False)
    for text in ("no stable(X)", "stable(red_can), stable(red_can)"):
        with pytest.raises(LanguageError, match="expected one literal"):
            parse_literal(text, scene)
    with pytest.raises(LanguageError, match="which X is meant"):
        parse_literal("stable(X)", scene)
