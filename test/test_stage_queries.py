"""What people ask the reasoner, and the axioms that it is told to learn."""

from __future__ import annotations

import msgspec
import pytest
from reasoner_samples import STAMP, TOWER, feed, objects, one, problems, relations, scene, stage

from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.learning import Axioms, LearnedAxiom
from ros_scenesense.messages.reasoning import Beliefs, Explanation, Knowledge, Query
from ros_scenesense.stages.reasoner import ReasonerStage


def ask(reasoner: ReasonerStage, literal: str, **fields: object) -> Explanation:
    query = Query(literal=literal, **fields)  # type: ignore[arg-type]
    [answer] = reasoner.handle(query, 7_000_000_000)
    assert isinstance(answer, Explanation)
    assert decode(encode(answer), Explanation) == answer
    return answer


@pytest.fixture
def reasoner() -> ReasonerStage:
    reasoner = stage()
    feed(reasoner, *TOWER)
    return reasoner


def test_a_query_is_answered_about_the_newest_scene(reasoner: ReasonerStage) -> None:
    answer = ask(reasoner, "-stable(cube)", id="q-1")
    assert (answer.id, answer.scene_id, answer.outcome) == ("q-1", "s-1", "explained")
    assert answer.holds is True
    assert answer.text.startswith("-stable(cube) by s2: ")
    first, *others = answer.steps
    assert (first.depth, first.literal, first.role, first.axiom) == (
        0,
        "-stable(cube)",
        "concluded",
        "s2",
    )
    known = {(each.literal, each.source, each.confidence) for each in others}
    assert ("obj_surface(duck, irregular)", "measured", None) in known
    assert ("touching(duck, cube)", "qsr", 0.9) in known


def test_why_not_is_answered_too(reasoner: ReasonerStage) -> None:
    answer = ask(reasoner, "stable(cube)", why="why_not", scene_id="s-1")
    assert answer.holds is False
    assert answer.text.startswith("stable(cube) does not hold")
    assert {each.role for each in answer.steps} >= {"missing", "attempt", "blocked"}
    assert ask(reasoner, "stable(duck)", why="why_not").text.startswith("stable(duck) does hold:")


def test_a_query_id_is_answered_once_and_the_same_question_again(reasoner: ReasonerStage) -> None:
    query = Query(literal="stable(duck)", id="q-1")
    assert len(reasoner.handle(query, 1)) == 1
    assert reasoner.handle(query, 2) == []
    assert reasoner.health.counters["query_repeated"] == 1
    anonymous = msgspec.structs.replace(query, id="")
    first, second = (one(reasoner.handle(anonymous, now), Explanation) for now in (3, 4))
    assert first.id != second.id


@pytest.mark.parametrize(
    ("literal", "scene_id", "words"),
    [
        ("stable(cup)", None, "'cup'"),
        ("stabel(cube)", None, "did you mean 'stable'"),
        ("stable(cube) :- a.", None, "literal:1:"),
        ('"); bad(', None, "literal:1:"),
        ("stable(cube)", "s-9", "scene s-9 is not among the last 50"),
    ],
)
def test_a_wrong_query_is_refused_with_the_reason(
    reasoner: ReasonerStage, literal: str, scene_id: str | None, words: str
) -> None:
    answer = ask(reasoner, literal, scene_id=scene_id)
    assert (answer.outcome, answer.holds, answer.steps) == ("refused", None, [])
    assert words in answer.text
    assert answer.literal == literal
    assert reasoner.health.counters["query_refused"] == 1


def test_before_the_first_scene_there_is_nothing_to_explain() -> None:
    answer = ask(stage(), "stable(cube)")
    assert (answer.scene_id, answer.outcome) == (None, "refused")
    assert answer.text == "no scene was decided yet"


def test_only_the_last_scenes_are_remembered() -> None:
    reasoner = stage(remembered_scenes=2)
    for number in (1, 2, 3):
        feed(reasoner, scene(number=number), objects(number=number), relations(number=number))
    assert "the newest are s-2, s-3" in ask(reasoner, "stable(a)", scene_id="s-1").text


def axioms(*learned: tuple[str, str, str], refuted: tuple[str, ...] = ()) -> Axioms:
    return Axioms(
        stamp=STAMP,
        revision=1,
        cycle=1,
        axioms=[
            LearnedAxiom(
                id=identifier,
                text=text,
                kind=kind,  # type: ignore[arg-type]
                strength=1.0,
                support=0.5,
                purity=0.9,
                age=0,
            )
            for identifier, kind, text in learned
        ],
        refuted=list(refuted),
    )


def test_learned_axioms_are_in_force_from_the_next_scene_on() -> None:
    reasoner = stage(withheld="s2")
    before = one(reasoner.start(0), Knowledge)
    text = "normally -stable(A) if above(A, B), obj_surface(B, irregular)."
    [knowledge] = reasoner.handle(axioms(("l1", "default", text)), 5)
    assert isinstance(knowledge, Knowledge)
    learned = [(each.id, each.origin, each.text) for each in knowledge.axioms[-1:]]
    assert learned == [("l1", "learned", text)]
    assert knowledge.revision != before.revision
    beliefs = one(feed(reasoner, *TOWER), Beliefs)
    assert beliefs.knowledge_revision == knowledge.revision
    assert beliefs.objects[1].stable.axioms == ["l1"]
    assert ask(reasoner, "-stable(cube)").steps[0].axiom == "l1"
    # The next message replaces what was learned before; older scenes stay explained as decided.
    [forgotten] = reasoner.handle(axioms(), 6)
    assert isinstance(forgotten, Knowledge)
    assert forgotten.revision == before.revision
    assert ask(reasoner, "-stable(cube)", id="later").steps[0].axiom == "l1"


def test_refuted_axioms_are_out_of_force() -> None:
    reasoner = stage()
    [knowledge] = reasoner.handle(axioms(refuted=("s1", "s9")), 5)
    assert isinstance(knowledge, Knowledge)
    assert "s1" not in {each.id for each in knowledge.axioms}
    assert one(feed(reasoner, *TOWER), Beliefs).objects[0].stable.value is None
    assert "'s9'" in problems(reasoner)["axiom_refused"]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (("l1", "normal", "stabel(A) if above(A, B)."), "stable"),
        (("l1", "default", "stable(A) if above(A, B)."), "says it is default"),
        (("s1", "normal", "stable(A) if above(A, B)."), "already"),
        (("l1", "normal", "stable(A) :- a). bad("), "axiom l1:1"),
        (("not a name", "normal", "stable(A) if above(A, B)."), "no name"),
    ],
)
def test_a_wrong_learned_axiom_is_reported_and_the_others_count(
    wrong: tuple[str, str, str], words: str
) -> None:
    reasoner = stage()
    right = ("l2", "normal", "stable(A) if on(A, table).")
    [knowledge] = reasoner.handle(axioms(wrong, right), 5)
    assert isinstance(knowledge, Knowledge)
    assert [each.id for each in knowledge.axioms if each.origin == "learned"] == ["l2"]
    assert words in problems(reasoner)["axiom_refused"]
