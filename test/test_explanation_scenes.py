"""Explanations of what was decided about scenes: their content, their text, their drawing."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.cli.main import main
from ros_scenesense.errors import LanguageError, ReasoningError
from ros_scenesense.knowledge.classification import ClassificationRule
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.reasoning.classification import ClassificationSession
from ros_scenesense.reasoning.explanation.drawing import drawing
from ros_scenesense.reasoning.explanation.reason import Role
from ros_scenesense.reasoning.explanation.scenes import SceneExplainer, SceneExplanation
from ros_scenesense.reasoning.explanation.text import outline, short
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject
from ros_scenesense.reasoning.program import Program
from ros_scenesense.reasoning.random_facts import random_facts
from ros_scenesense.scene import Distance, Position, Size, Surface
from ros_scenesense.stages.queries import words_of

PROGRAM = Program.shipped()
AXIOMS = [axiom.id for axiom in PROGRAM.axioms]


def on(upper: str, lower: str, confidence: float = 0.9, touching: bool = True) -> PairRelation:
    distance = Distance.TOUCHING if touching else Distance.NOT_TOUCHING
    return PairRelation(upper, lower, Position.ABOVE, distance, confidence, 0.75, "qsr", "human")


DUCK = SceneObject("duck", surface=Surface.IRREGULAR, surface_source="given")
CUBE = SceneObject("cube", size=Size.SMALL, size_source="measured")
CAN = SceneObject("can", size=Size.LARGE)
TOWER = SceneFacts(
    (DUCK, CUBE, CAN), (on("cube", "duck"), on("can", "cube"), on("can", "duck", touching=False))
)


def explain(
    literal: str,
    facts: SceneFacts = TOWER,
    withheld: tuple[str, ...] = (),
    program: Program = PROGRAM,
) -> SceneExplanation:
    explainer = SceneExplainer(program, facts, withheld)
    return explainer.explain(explainer.literal(literal))


def test_a_proof_goes_down_to_what_was_perceived_and_given_with_its_source() -> None:
    explained = explain("-stable(can)")
    assert explained.holds
    assert outline(explained.reason).splitlines() == [
        "-stable(can) by s2: An object with an irregular surface below it in its stack is "
        "unstable.",
        "└─ irregular_below(can) by irregular_further_under: What is below an object is below "
        "everything on it.",
        "   ├─ on(can, cube) by on_object: An object is on another if it is above and touches it.",
        "   │  ├─ above(can, cube): perceived by QSR, confidence 0.90",
        "   │  └─ touching(can, cube): said by a person, confidence 0.75",
        "   └─ irregular_below(cube) by irregular_under: An object on one with an irregular "
        "surface has an irregular surface below it.",
        "      ├─ on(cube, duck) by on_object: An object is on another if it is above and touches "
        "it.",
        "      │  ├─ above(cube, duck): perceived by QSR, confidence 0.90",
        "      │  └─ touching(cube, duck): said by a person, confidence 0.75",
        "      └─ obj_surface(duck, irregular): given",
    ]
    assert short(explained.reason) == "-stable(can) by s2: irregular_below(can)"


def test_a_default_is_taken_only_where_no_normal_axiom_says_it() -> None:
    explained = explain("-stable(can)", withheld=("s2",))
    assert outline(explained.reason).splitlines() == [
        "-stable(can) by large_on_small: A large object on a small one is unstable. (A default.)",
        "├─ on(can, cube) by on_object: An object is on another if it is above and touches it.",
        "│  ├─ above(can, cube): perceived by QSR, confidence 0.90",
        "│  └─ touching(can, cube): said by a person, confidence 0.75",
        "├─ obj_size(can, large)",
        "├─ obj_size(cube, small): measured",
        "└─ not stable(can): nothing concludes it",
    ]


def test_why_not_names_the_axioms_and_what_each_lacks() -> None:
    explained = explain("stable(can)", withheld=("s2", "s3", "large_on_small"))
    assert not explained.holds
    assert outline(explained.reason).splitlines() == [
        "stable(can) does not hold: nor does -stable(can): it is undecided",
        "└─ not by s1: An object that is above no other object is stable.",
        "   └─ not above(can, _) fails",
        "      ├─ above(can, duck): perceived by QSR, confidence 0.90",
        "      └─ above(can, cube): perceived by QSR, confidence 0.90",
    ]
    assert short(explained.reason) == "stable(can) does not hold: s1 lacks not above(can, _)"

    unstable = explain("-stable(cube)", withheld=("s2",))
    lines = outline(unstable.reason).splitlines()
    assert "├─ not by tall_tower: An object above the fourth level of a tower is unstable." in (
        line.removesuffix(" (A default.)") for line in lines
    )
    assert "│  └─ 2 > 4: this is not so" in lines
    assert lines[-1] == (
        "└─ not by s2: An object with an irregular surface below it in its stack is unstable. It "
        "is withheld."
    )
    assert any("obj_size(cube, large) does not hold: the size of cube is small" in x for x in lines)


def test_what_was_perceived_instead_is_told() -> None:
    assert outline(explain("left(can, cube)").reason) == (
        "left(can, cube) does not hold: can is above cube, touching"
    )
    assert "the surface of cube is not known" in outline(explain("obj_surface(cube, flat)").reason)


def test_what_is_not_known_is_a_reason_against() -> None:
    hidden = SceneFacts((SceneObject("cube"), SceneObject("hidden", located=False)), ())
    assert outline(explain("stable(cube)", hidden).reason).splitlines()[1:] == [
        "└─ not by s1: An object that is above no other object is stable.",
        "   └─ not above(cube, _) fails",
        "      └─ above(cube, hidden) may hold",
        "         └─ above(cube, hidden) is not known",
    ]


def test_a_reason_is_told_in_full_once() -> None:
    program = PROGRAM.extended({"twice": "-occluded(A) if small_base(A), irregular_below(A)."})
    text = outline(explain("-occluded(can)", withheld=("o1", "o2"), program=program).reason)
    assert text.count("above(can, cube): perceived") == 1
    assert "on(can, cube) by on_object: " in text
    assert "(see above)" in text


def test_a_contradiction_is_told_with_what_was_withdrawn() -> None:
    names = ("a", "b", "c")
    circle = SceneFacts(
        tuple(SceneObject(each, surface=Surface.IRREGULAR) for each in names),
        (on("a", "b"), on("b", "c"), on("c", "a", confidence=0.25)),
    )
    explained = explain("-stable(b)", circle)
    assert explained.holds
    [wrong] = explained.withdrawn
    assert (wrong.relation, wrong.object, wrong.reference) == ("above", "c", "a")
    assert "not believed is that c is above a, confidence 0.25" in words_of(explained)


def test_what_holds_in_some_answer_sets_only_does_not_hold() -> None:
    program = PROGRAM.without(AXIOMS).extended(
        {
            "stands": "normally stable(A) if on(A, B).",
            "falls": "normally -stable(A) if on(A, B).",
        }
    )
    explained = explain("stable(can)", program=program)
    assert not explained.holds
    assert explain("-stable(can)", program=program).holds is False


def test_what_is_concluded_with_its_opposite_is_inconsistent() -> None:
    program = PROGRAM.extended({"wrong": "-stable(A) if obj_surface(A, irregular)."})
    explained = explain("stable(duck)", program=program)
    assert not explained.holds
    assert [each.axiom for each in explained.reason.reasons] == ["s1", "wrong"]
    assert outline(explained.reason).startswith(
        "stable(duck) does not hold: -stable(duck) is concluded too, which is inconsistent"
    )
    assert explain("-stable(duck)", program=program).holds is False


def test_objects_go_by_constants_and_keep_their_names() -> None:
    strange = SceneFacts((SceneObject("a). bad("), SceneObject("table")), ())
    explained = explain("-occluded(object_1)", strange)
    assert dict(explained.renamed) == {"object_1": "a). bad(", "object_2": "table"}
    assert words_of(explained).endswith("object_1 is 'a). bad('.\nobject_2 is 'table'.")


@pytest.mark.parametrize(
    ("literal", "words"),
    [
        ("stabel(can)", "did you mean 'stable'"),
        ("stable(cup)", "'cup'"),
        ("stable(can, can)", "stable"),
        ("stable(X)", "X"),
        ("no stable(X)", "expected one literal"),
        ("", "literal:1:1"),
        ("stable(can). pos(a)", "literal:1"),
        ("a). bad(", "literal:1"),
    ],
)
def test_a_wrong_literal_is_refused_with_its_place(literal: str, words: str) -> None:
    with pytest.raises(LanguageError) as caught:
        explain(literal)
    assert words in str(caught.value)


def test_there_is_nothing_to_explain_where_nothing_holds() -> None:
    description = PROGRAM.description
    assert description is not None
    rules = [ClassificationRule(":- obj_surface(A, irregular).", "flat_world")]
    program = Program(rules, [])
    with pytest.raises(ReasoningError, match="not translated"):
        SceneExplainer(program, TOWER)
    program.description = description
    with pytest.raises(ReasoningError, match="nothing holds"):
        SceneExplainer(program, TOWER)


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 10_000), st.sets(st.sampled_from(AXIOMS)))
def test_every_belief_has_an_explanation_and_nothing_else_has(
    seed: int, withheld: set[str]
) -> None:
    facts = random_facts(5, np.random.default_rng(seed))
    beliefs = ClassificationSession(PROGRAM, 60.0).classify(facts, withheld)
    explainer = SceneExplainer(PROGRAM, facts, withheld)
    for each in beliefs.objects:
        for fluent, belief in (("stable", each.stable), ("occluded", each.occluded)):
            for value in (True, False):
                literal = Literal(Atom(fluent, (Constant(each.name),)), value)
                explained = explainer.explain(literal)
                assert explained.holds is (belief.value is value)
                if explained.holds:
                    assert explained.reason.axiom in belief.axioms
                    kinds = {a.id: a.kind for a in PROGRAM.axioms}
                    strict = kinds[str(explained.reason.axiom)] == "normal"
                    assert strict is (belief.status == "strict")
                else:
                    assert explained.reason.role is Role.MISSING


def test_the_drawing_shows_every_reason_and_is_well_formed() -> None:
    reason = explain("stable(can)").reason
    root = ElementTree.fromstring(drawing(reason))
    texts = [each.text for each in root.iter("{http://www.w3.org/2000/svg}text")]
    assert "stable(can) does not hold" in texts
    assert "not by s1" in texts
    boxes = list(root.iter("{http://www.w3.org/2000/svg}rect"))
    assert len(boxes) == 1 + len(list(reason.walk()))
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    for box in boxes[1:]:
        assert float(box.attrib["x"]) + float(box.attrib["width"]) <= width
        assert float(box.attrib["y"]) + float(box.attrib["height"]) <= height


SCENE = """
objects:
  duck: {surface: irregular}
  white_cube: {size: medium}
  red_can:
relations: ["on(white_cube, duck)", "on(red_can, white_cube)"]
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


def test_the_command_explains(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    svg = tmp_path / "why.svg"
    assert main(["explain", "-stable(red_can)", "--scene", str(scene), "--svg", str(svg)]) == 0
    assert "obj_surface(duck, irregular): given" in capsys.readouterr().out
    ElementTree.parse(svg)
    arguments = ["explain", "stable(duck)", "--scene", str(scene)]
    assert main([*arguments, "--why-not"]) == 0
    assert capsys.readouterr().out.startswith("stable(duck) does hold:\n")
    assert main([*arguments, "--json", "--without", "s1"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["holds"] is False
    assert answer["explanation"]["role"] == "missing"
    assert [each["axiom"] for each in answer["explanation"]["reasons"]] == ["s1"]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["stabel(duck)"], 1, "did you mean 'stable'"),
        (["stable(duck)", "--without", "s9"], 2, "--without: there is no axiom s9"),
        (["stable(duck)", "--scene-id", "s-1"], 2, "--scene-id"),
        (["stable(duck)", "--svg", "/nowhere/why.svg"], 1, "/nowhere/why.svg cannot be written"),
    ],
)
def test_the_command_refuses_what_is_wrong(
    scene: Path,
    arguments: list[str],
    code: int,
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["explain", *arguments, "--scene", str(scene)]) == code
    error = capsys.readouterr().err
    assert words in error
    assert error.startswith("scenesense explain: ")


@pytest.mark.parametrize("option", [["--svg", "x.svg"], ["--without", "s1"]])
def test_the_running_graph_is_asked_in_words(
    option: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explain", "stable(duck)", *option]) == 2
    assert f"{option[0]} needs --scene" in capsys.readouterr().err


@pytest.mark.parametrize("page", ["README.md", "docs/explanation.md"])
def test_the_documentation_shows_what_the_command_prints(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    root = Path(__file__).resolve().parent.parent
    text = (root / page).read_text()
    [described] = re.findall(r"```yaml\n(objects:.*?)```", text, re.DOTALL)
    (tmp_path / "tower.yaml").write_text(described)
    (tmp_path / "asp").symlink_to(root / "asp")
    monkeypatch.chdir(tmp_path)
    shown = re.findall(r"```console\n\$ scenesense (explain .*?)\n(.*?)```", text, re.DOTALL)
    assert shown
    for command, output in shown:
        assert main(shlex.split(command)) == 0
        assert capsys.readouterr().out == output
