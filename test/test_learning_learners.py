"""The two learners of axioms: what they find, and examples that they cannot learn from."""

from dataclasses import replace

import numpy as np
import pytest
from learning_samples import DOMAIN, RELEVANT, examples, texts

from ros_scenesense.errors import LearningError
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.writing import written
from ros_scenesense.learning.bodies import holding
from ros_scenesense.learning.columns import Table, columns_of
from ros_scenesense.learning.covering_learner import CoveringLearner
from ros_scenesense.learning.examples import Example, SceneState, checked
from ros_scenesense.learning.paper_learner import PaperLearner
from ros_scenesense.learning.scoring import Judge
from ros_scenesense.learning.trees import branches, grow

STABLE = examples("stable", 50)
OCCLUDED = examples("occluded", 50, seed=1)


@pytest.mark.parametrize("kind", [PaperLearner, CoveringLearner])
def test_an_axiom_of_the_paper_is_learned(kind):
    learner = kind(DOMAIN, "occluded", RELEVANT["occluded"], trees=40).fit(OCCLUDED)
    assert "-occluded(A) if not behind(A, B)." in texts(learner)
    again = kind(DOMAIN, "occluded", RELEVANT["occluded"], trees=40).fit(OCCLUDED)
    assert texts(again) == texts(learner)


def test_what_is_learned_can_be_read_again():
    learner = CoveringLearner(DOMAIN, "stable", RELEVANT["stable"], trees=30).fit(STABLE)
    domain = DOMAIN
    for number, each in enumerate(learner.axioms_):
        text = written([each.axiom]).replace("learned:", f"learned_{number}:")
        domain = parse(text, "learned", domain).description
        assert str(domain.axioms[-1]) == str(each.axiom)
    assert len(domain.axioms) == len(DOMAIN.axioms) + len(learner.axioms_) > len(DOMAIN.axioms)


def test_covering_finds_the_rules_behind_the_labels():
    reduced = DOMAIN.without({"s1", "s2", "s3"})
    learner = CoveringLearner(reduced, "stable", RELEVANT["stable"], trees=40).fit(STABLE)
    judge = Judge(DOMAIN, "stable", examples("stable", 150, seed=5))
    score = judge.score([each.axiom for each in learner.axioms_])
    assert {"-stable(A) if irregular_below(A).", "-stable(A) if small_base(A)."} <= {
        each.text for each in score.judged
    }
    assert all(each.true for each in score.judged)
    assert "s2" in score.found


def test_wrong_labels_cost_the_plain_algorithm_more_than_ours():
    noisy = examples("occluded", 50, seed=2, flip=0.03)
    ours = CoveringLearner(DOMAIN, "occluded", RELEVANT["occluded"], slack=0.03, trees=40)
    assert "-occluded(A) if not behind(A, B)." in texts(ours.fit(noisy))


def test_the_paper_learns_from_what_reasoning_lacks_alone():
    right = [Example(e.scene_id, e.state, e.target, e.label, "right") for e in STABLE]
    with pytest.raises(LearningError, match="no labelled examples"):
        PaperLearner(DOMAIN, "stable").fit(right)


def test_algorithm_1_ends_branches_at_its_purity_and_so_finds_defaults():
    # In one of five cases something else decides, which no column tells.
    generator = np.random.default_rng(4)
    some = [
        replace(each, label=bool(each.label and generator.random() < 0.8))
        for each in examples("occluded", 80, seed=3)
    ]
    learner = PaperLearner(DOMAIN, "occluded", RELEVANT["occluded"], trees=40).fit(some)
    kinds = {str(each.axiom): each.axiom.kind for each in learner.axioms_}
    assert kinds["-occluded(A) if not behind(A, B)."] == "normal"
    assert any(
        kind == "default" and text.startswith("normally occluded(A) if behind(A, B)")
        for text, kind in kinds.items()
    )
    strict = PaperLearner(
        DOMAIN, "occluded", RELEVANT["occluded"], default_purity=None, trees=40
    ).fit(some)
    assert {each.axiom.kind for each in strict.axioms_} == {"normal"}


def test_a_node_of_the_given_purity_is_a_leaf_but_never_the_root():
    table = Table.of(columns_of(DOMAIN, "object", RELEVANT["stable"]), STABLE)
    tree = grow(table, table.everything, pure=0.65)
    assert tree.purity >= 0.65
    assert tree.column is not None
    for path, leaf in branches(tree):
        inner = holding(table, path[:-1], table.everything)
        positive = (inner & table.positive).bit_count()
        purity = max(positive, inner.bit_count() - positive) / inner.bit_count()
        assert leaf.purity >= 0.65
        assert len(path) == 1 or purity < 0.65


def world(columns, counts):
    """Examples of a tiny domain: for which attributes, how many true and how many false ones."""
    domain = parse(
        "sort thing. static "
        + ", ".join(f"{name}(thing)" for name in columns)
        + ". estimated fluent good(thing)."
    ).description
    found = []
    for attributes, (positive, negative) in counts.items():
        facts = frozenset((name, (0,)) for name in attributes.split())
        for number in range(positive + negative):
            name = f"{attributes}-{number}"
            found.append(Example(name, SceneState(("t",), facts), 0, number < positive))
    return domain, found


def test_what_explains_much_must_also_be_true_of_what_it_adds():
    # `b` is true of 95 %, but only because it holds of all that `a` explains.
    domain, found = world("abc", {"a b": (190, 0), "b": (5, 10), "c": (2, 30)})
    learner = CoveringLearner(domain, "good", trees=20).fit(found)
    assert "good(A) if a(A)." in texts(learner)
    assert not any(
        each.axiom.kind == "normal"
        and "b(A)" in str(each.axiom.body[0])
        and each.axiom.head.positive
        for each in learner.axioms_
    )


def test_of_bodies_that_say_nearly_the_same_the_most_general_is_learned():
    # `small` holds of most that `wide` holds of, and is a little truer by chance alone.
    domain, found = world(("small", "wide"), {"small wide": (38, 2), "wide": (8, 2), "": (5, 45)})
    learner = CoveringLearner(domain, "good", purity=0.99, trees=20).fit(found)
    assert "normally good(A) if wide(A)." in texts(learner)
    assert "normally good(A) if small(A)." not in texts(learner)


def test_a_default_names_the_exceptions_that_it_would_be_wrong_without():
    # Of what is `far` all is bad, also what is `seen`: without it `seen` is true too seldom.
    domain, found = world(
        ("seen", "far"), {"seen": (28, 8), "seen far": (0, 8), "far": (0, 60), "": (4, 60)}
    )
    learner = CoveringLearner(domain, "good", trees=20).fit(found)
    assert "-good(A) if far(A)." in texts(learner)
    (default,) = [text for text in texts(learner) if text.startswith("normally good")]
    assert default == "normally good(A) if seen(A), -far(A)."


def test_a_default_of_the_domain_is_not_learned_as_a_law():
    domain, found = world("ab", {"a": (0, 9), "b": (20, 0), "": (20, 20)})
    assert "-good(A) if a(A)." in texts(CoveringLearner(domain, "good", trees=20).fit(found))
    given_too = parse("usual: normally -good(A) if a(A).", "test", domain).description
    learner = CoveringLearner(given_too, "good", trees=20).fit(found)
    assert "good(A) if b(A)." in texts(learner)
    assert not any(" a(A)." in text for text in texts(learner))


def test_that_something_is_of_a_kind_must_pay_beyond_that_it_is_there():
    state = {
        kind: SceneState(("t", "o"), frozenset({("by", (0, 1)), ("hue", (1, kind))}))
        for kind in ("red", "blue")
    }
    alone = SceneState(("t",), frozenset())
    domain = parse(
        "sort thing. sort tint = {red, blue}. static hue(thing, tint). "
        "inertial fluent by(thing, thing). estimated fluent good(thing)."
    ).description
    table_examples = [
        *(Example(f"r{n}", state["red"], 0, n < 28) for n in range(30)),
        *(Example(f"b{n}", state["blue"], 0, n < 26) for n in range(30)),
        *(Example(f"n{n}", alone, 0, n < 3) for n in range(40)),
    ]
    learner = CoveringLearner(domain, "good", purity=0.99, trees=20).fit(table_examples)
    assert "normally good(A) if by(A, B)." in texts(learner)
    assert not any("hue" in text for text in texts(learner))


# --- Bad input.


def test_nothing_is_learned_from_nothing():
    with pytest.raises(LearningError, match="collect labelled scenes"):
        CoveringLearner(DOMAIN, "stable").fit([])


def test_nothing_is_learned_from_one_label():
    alike = [each for each in STABLE if each.label]
    with pytest.raises(LearningError, match="have the label true"):
        CoveringLearner(DOMAIN, "stable").fit(alike)


def test_examples_that_contradict_each_other_are_left_out():
    first = STABLE[0]
    opposite = Example(first.scene_id, first.state, first.target, not first.label)
    assert checked([*STABLE, opposite], DOMAIN) == STABLE[1:]
    assert checked([*STABLE, first], DOMAIN) == STABLE


def test_an_unknown_relation_is_named():
    state = SceneState(("a", "b"), frozenset({("levitates", (0, 1))}))
    with pytest.raises(LearningError, match="'levitates'"):
        checked([Example("s", state, 0, True), Example("s", state, 1, False)], DOMAIN)
