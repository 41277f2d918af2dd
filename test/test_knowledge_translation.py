from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import clingo
import pytest

from ros_scenesense.knowledge.action_language import Domain, load, parse
from ros_scenesense.knowledge.axioms import StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.translation import Options, translate
from ros_scenesense.resources import resource

PAPER = """\
sort object = {a, b}. sort robot = {rob1}. sort relation = {above, below, behind, infront}.
inertial fluent obj_relation(relation, object, object), in_hand(robot, object).
action pickup(robot, object), putdown(robot, object, object).
pickup(R, A) causes in_hand(R, A).
obj_relation(below, B, A) if obj_relation(above, A, B).
obj_relation(behind, B, A) if obj_relation(infront, A, B).
impossible pickup(R, A) if in_hand(R, A).
impossible putdown(R, A, L) if not in_hand(R, A).
"""
TRACE = """\
sort object += {duck, white_cube, red_can}.
obj_surface(duck, irregular). obj_surface(white_cube, flat). obj_surface(red_can, flat).
initially above(duck, white_cube), touching(duck, white_cube),
    above(white_cube, red_can), touching(white_cube, red_can),
    above(duck, red_can), not_touching(duck, red_can).
hpd(pickup(rob1, duck), 0). hpd(putdown(rob1, duck, table), 1).
hpd(pickup(rob1, white_cube), 2). hpd(putdown(rob1, white_cube, duck), 3).
"""


@pytest.fixture(scope="module")
def robot_assistant() -> SystemDescription:
    return load(resource("asp", "robot_assistant.al")).description


def answers(domain: Domain, options: Options | None = None, *arguments: str) -> list[set[str]]:
    """All optimal answer sets; clingo has nothing to complain about."""
    complaints: list[str] = []
    control = clingo.Control(
        ["0", "--opt-mode=optN", *arguments], logger=lambda _, text: complaints.append(text)
    )
    control.add(translate(domain.description, domain.history, options))
    control.ground()
    with control.solve(yield_=True) as handle:
        found = [
            {str(symbol) for symbol in model.symbols(shown=True)}
            for model in handle
            if not model.cost or model.optimality_proven
        ]
    assert complaints == []
    return found


def rules(description: SystemDescription) -> list[str]:
    text = translate(description, parse(PAPER).history)
    # A rule that goes over several lines becomes one.
    return re.sub(r"\n    ", " ", text).splitlines()


def test_the_statements_of_the_paper_are_translated_as_its_action_language_has_them() -> None:
    lines = rules(parse(PAPER).description)
    assert "holds(in_hand(R, A), I + 1) :- occurs(pickup(R, A), I), I < steps." in lines
    assert "holds(obj_relation(below, B, A), I) :- holds(obj_relation(above, A, B), I)." in lines
    assert "holds(obj_relation(behind, B, A), I) :- holds(obj_relation(infront, A, B), I)." in lines
    assert "-occurs(pickup(R, A), I) :- holds(in_hand(R, A), I), step(I)." in lines
    assert (
        "-occurs(putdown(R, A, L), I) :- "
        "not holds(in_hand(R, A), I), robot(R), object(A), object(L), step(I)." in lines
    )


def test_what_was_expected_needs_no_explanation(robot_assistant: SystemDescription) -> None:
    seen = "obs(on(white_cube, duck), true, 4). obs(on(duck, table), true, 4)."
    domain = parse(TRACE + seen, "trace", robot_assistant.without({"s2"}))
    (answer,) = answers(domain)
    assert not any(each.startswith("applied") for each in answer)
    assert "holds(on(white_cube,duck),4)" in answer
    assert "holds(in_hand(rob1,white_cube),3)" in answer
    assert "holds(tower_height(white_cube,2),4)" in answer


def test_the_unexpected_outcome_of_trace_1_has_one_smallest_explanation(
    robot_assistant: SystemDescription,
) -> None:
    seen = "obs(on(white_cube, duck), false, 4). obs(on(white_cube, table), true, 4)."
    domain = parse(TRACE + seen, "trace", robot_assistant.without({"s2"}))
    (answer,) = answers(domain)
    assert {each for each in answer if each.startswith("applied")} == {
        "applied(event(fall(white_cube)),3)"
    }
    assert answers(domain, None, "-c", "restore=0") == []


def test_an_observation_against_a_default_is_an_exception(
    robot_assistant: SystemDescription,
) -> None:
    text = """sort object += {pot, cube}. obj_size(pot, large). obj_size(cube, small).
        initially above(pot, cube), touching(pot, cube)."""
    plain = parse(text, "t", robot_assistant)
    (answer,) = answers(plain)
    assert "-holds(stable(pot),0)" in answer
    found = answers(parse(text + "obs(stable(pot), true, 0).", "t", robot_assistant))
    # An exception of one default makes the pot stable, and the other default yields to that.
    assert sorted(each for answer in found for each in answer if each.startswith("applied")) == [
        "applied(exception(large_on_small(pot)),0)",
        "applied(exception(s3(pot)),0)",
    ]
    assert all("holds(stable(pot),0)" in answer for answer in found)


def test_what_no_axiom_covers_is_neither_true_nor_false_in_any_step(
    robot_assistant: SystemDescription,
) -> None:
    domain = parse(TRACE, "trace", robot_assistant.without({"s1", "s2", "s3", "o1", "o2", "o3"}))
    (answer,) = answers(domain, Options(show_all=True))
    assert not any("stable" in each or "occluded" in each for each in answer)
    # Inertial fluents keep what is known of them and defined ones are closed.
    assert "-holds(in_hand(rob1,duck),2)" in answer
    assert "-holds(on(duck,white_cube),1)" in answer


def test_no_axiom_fires_on_an_attribute_that_is_not_known(
    robot_assistant: SystemDescription,
) -> None:
    text = TRACE.replace("obj_surface(white_cube, flat).", "").replace(
        "(red_can, flat)", "(duck, flat)"
    )
    domain = parse(text, "trace", robot_assistant)
    (answer,) = answers(domain)
    assert not any(each.startswith("-holds(stable(duck),0)") for each in answer)
    assert not any(each.startswith("holds(stable(duck),0)") for each in answer)


def test_what_is_unknown_is_learned_by_seeing_and_lasts() -> None:
    domain = parse(PAPER + "obs(in_hand(rob1, a), true, 1). hpd(pickup(rob1, b), 2).")
    (answer,) = answers(domain, Options(steps=3))
    assert {each for each in answer if "in_hand" in each} == {
        "holds(in_hand(rob1,a),1)",
        "holds(in_hand(rob1,a),2)",
        "holds(in_hand(rob1,a),3)",
        "holds(in_hand(rob1,b),3)",
    }


def test_what_is_known_is_not_changed_by_seeing_something_else() -> None:
    for initial in ("initially -in_hand(rob1, a).", "obs(in_hand(rob1, a), false, 0)."):
        assert answers(parse(PAPER + initial + "obs(in_hand(rob1, a), true, 1).")) == []


def test_a_complete_initial_state_has_every_value() -> None:
    text = "inertial fluent p, q. action go. go causes p if q. q if p. initially -p. hpd(go, 0)."
    domain = parse(text)
    assert len(answers(domain)) == 1
    found = answers(domain, Options(complete=True, show_all=True))
    assert sorted(sorted(each - {"occurs(go,0)"}) for each in found) == [
        ["-holds(p,0)", "-holds(p,1)", "-holds(q,0)", "-holds(q,1)"],
        ["-holds(p,0)", "holds(p,1)", "holds(q,0)", "holds(q,1)"],
    ]


def test_an_impossible_action_cannot_have_happened() -> None:
    text = PAPER + "initially in_hand(rob1, a). hpd(pickup(rob1, a), 0)."
    assert answers(parse(text)) == []
    together = PAPER + "impossible pickup(R, A), pickup(R, B) if A != B."
    done = "hpd(pickup(rob1, a), 0). hpd(pickup(rob1, b), {})."
    assert len(answers(parse(together + done.format(1)))) == 1
    assert answers(parse(together + done.format(0))) == []


def test_the_step_has_a_variable_of_its_own() -> None:
    text = "sort s = {a}. inertial fluent p(s), q(s), I(s).".replace(", I(s)", "")
    lines = rules(parse(text + "p(I) if q(I), J != I, q(J).").description)
    assert "holds(p(I), K) :- holds(q(I), K), J != I, holds(q(J), K)." in lines


def test_words_never_become_program_text() -> None:
    description = parse(PAPER).description
    axiom = StateConstraint(
        id="bad", head=Literal(Atom("in_hand", description.axioms[0].conclusions[0].atom.arguments))
    )
    bad = replace(axiom, words="fine\nholds(bad, 0).\r\n% *%\0")
    text = translate(replace(description, axioms=(bad,), source="x\ny."), parse(PAPER).history)
    assert "% bad (normal): fine holds(bad, 0). % *%\n" in text
    assert "% The domain x y. and a history" in text


def test_the_program_is_run_by_clingo_alone(
    robot_assistant: SystemDescription, tmp_path: Path
) -> None:
    domain = parse(TRACE, "trace", robot_assistant)
    program = tmp_path / "program.lp"
    program.write_text(translate(domain.description, domain.history))
    command = [sys.executable, "-m", "clingo", str(program), "0"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.stderr == ""
    assert "holds(on(white_cube,duck),4)" in done.stdout
    assert max(map(len, program.read_text().splitlines())) <= 100
