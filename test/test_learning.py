"""What learning is made of: columns, trees, scores, confidence, groups of versions, strength."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from learning_samples import DOMAIN, RELEVANT, examples

from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.learning.bodies import holding
from ros_scenesense.learning.columns import Table, columns_of
from ros_scenesense.learning.confidence import belief, difference, lower_bound
from ros_scenesense.learning.drawing import draw_tree
from ros_scenesense.learning.evaluation import holds
from ros_scenesense.learning.grouping import grouped, same_statement
from ros_scenesense.learning.scoring import Judge
from ros_scenesense.learning.strength import FORGOTTEN_BELOW, Strength
from ros_scenesense.learning.trees import branches, exported, grow

STABLE = examples("stable", 50)
OCCLUDED = examples("occluded", 50, seed=1)


def axiom(text, name="x"):
    return parse(f"{name}: {text}", "test", DOMAIN).description.axioms[-1]


# --- The relational description.


def test_columns_come_from_the_signature_alone():
    names = [str(column) for column in columns_of(DOMAIN, "object", RELEVANT["stable"])]
    assert {"above(A, B)", "small_base(A)", "obj_size(A, small)", "on(A, table)"} <= set(names)
    assert {"tower_height(A, B), B > 4", "on(A, B), obj_size(B, small)"} <= set(names)
    # Neither what is not relevant, nor what is defined from it, nor what is to be estimated.
    assert not any(word in name for name in names for word in ("left", "beside", "near", "stable"))
    assert len(names) == len(set(names))


def test_all_relations_are_columns_where_none_is_said_to_be_relevant():
    names = [str(column) for column in columns_of(DOMAIN, "object")]
    assert {"left(A, B)", "near(A, B)", "next_to(A, B)"} <= set(names)


def test_columns_of_another_domain():
    domain = parse(
        "sort thing = {a, b}. sort tint = {red, blue}. static tinted(thing, tint). "
        "inertial fluent beside(thing, thing). estimated fluent lost(thing)."
    ).description
    names = [str(column) for column in columns_of(domain, "thing")]
    assert "beside(A, B), tinted(B, red)" in names
    assert "tinted(A, blue)" in names


def test_answers_are_those_of_the_axioms_that_say_them():
    table = Table.of(columns_of(DOMAIN, "object"), STABLE[:60])
    for number, column in enumerate(table.columns):
        for answer in (True, False):
            said = column.if_true if answer else column.if_false
            if said is None:
                continue
            body = ", ".join(map(str, said))
            rule = axiom(f"stable(A) if {body}.")
            held = holding(table, [(number, answer)], table.everything)
            for bit, example in enumerate(STABLE[:60]):
                assert holds(rule, example.state, example.target) == bool(held >> bit & 1), body


# --- Trees.


def test_a_tree_separates_what_columns_can_tell():
    table = Table.of(columns_of(DOMAIN, "object", RELEVANT["stable"]), STABLE)
    tree = grow(table, table.everything)
    leaves = list(branches(tree))
    assert all(leaf.purity == 1.0 for _, leaf in leaves)
    assert sum(leaf.count for _, leaf in leaves) == len(STABLE)
    for path, leaf in leaves:
        assert holding(table, path, table.everything).bit_count() == leaf.count
    text = exported(tree, table, "stable")
    assert "small_base(A)?" in text
    assert text.count("\n") > len(leaves)


def test_a_tree_is_drawn_with_its_chosen_branches_marked():
    import cv2

    table = Table.of(columns_of(DOMAIN, "object", RELEVANT["stable"]), STABLE)
    tree = grow(table, table.everything, depth=2)
    plain = draw_tree(tree, table, "stable")
    assert draw_tree(tree, table, "stable") == plain
    path, _ = next(branches(tree))
    marked = draw_tree(tree, table, "stable", [frozenset(path)])

    def blue(content):
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR).astype(int)
        return int((image[..., 0] > image[..., 2] + 60).sum())

    assert blue(plain) == 0 < blue(marked)


# --- Scoring.


def test_equal_extension_is_told_from_equal_text():
    judge = Judge(DOMAIN, "occluded", OCCLUDED)
    one, other, wrong = judge.score(
        [
            axiom("-occluded(A) if not behind(A, B)."),
            axiom("-occluded(A) if not front(B, A)."),
            axiom("occluded(A) if not behind(A, B)."),
        ]
    ).judged
    assert (one.equals, one.same_text, one.true) == ("o1", True, True)
    assert (other.equals, other.same_text, other.true) == ("o1", False, True)
    assert (wrong.equals, wrong.true) == (None, False)


def test_a_default_that_only_repeats_a_normal_axiom_is_true_but_equals_nothing():
    judge = Judge(DOMAIN, "occluded", OCCLUDED)
    repeated, opposite = judge.score(
        [
            axiom("normally -occluded(A) if not behind(A, B)."),
            axiom("normally occluded(A) if not behind(A, B)."),
        ]
    ).judged
    assert (repeated.true, repeated.equals) == (True, None)
    assert not opposite.true


# --- Confidence.


@given(st.integers(1, 500), st.data())
def test_a_lower_bound_is_below_the_share(count, data):
    hits = data.draw(st.integers(0, count))
    assert -1e-9 <= lower_bound(hits, count, 1.6) <= hits / count + 1e-9
    assert lower_bound(2 * hits, 2 * count, 1.6) >= lower_bound(hits, count, 1.6) - 1e-9


@given(st.integers(0, 60), st.data())
def test_a_belief_is_the_tail_of_a_beta_distribution(count, data):
    from scipy.special import betaincc

    hits = data.draw(st.integers(0, count))
    least = data.draw(st.floats(0.05, 0.99))
    found = belief(hits, count, least)
    assert found == pytest.approx(betaincc(hits + 1, count - hits + 1, least), abs=1e-9)


def test_a_difference_needs_numbers():
    assert difference(9, 10, 5, 10) < 2.5 < difference(90, 100, 50, 100)
    assert difference(5, 5, 0, 0) == 0.0


# --- Groups.


def test_versions_of_an_axiom_are_a_group():
    general = axiom("-occluded(A) if not behind(A, B).", "general")
    over = axiom("-occluded(X) if not behind(X, Y), above(X, Z).", "over")
    other = axiom("normally -occluded(A) if behind(A, B), above(A, C).", "other")
    opposite = axiom("occluded(A) if not behind(A, B).", "opposite")
    assert grouped([over, other, opposite, general], DOMAIN.signature) == [[general, over]]


def test_a_special_case_of_two_axioms_does_not_set_them_against_each_other():
    first = axiom("-occluded(A) if above(A, B).", "first")
    second = axiom("-occluded(A) if not behind(A, B).", "second")
    both = axiom("-occluded(A) if not behind(A, B), above(A, C).", "both")
    (group,) = grouped([first, second, both], DOMAIN.signature)
    assert len(group) == 2
    assert both in group


def test_a_subsort_is_grouped_with_the_general_sort():
    domain = parse(
        "sort thing. sort cup < thing = {c}. inertial fluent wet(thing). "
        "estimated fluent clean(thing)."
    ).description

    def read(text, name):
        return parse(f"{name}: {text}", "test", domain).description.axioms[-1]

    special = read("-clean(A) if wet(A), cup(A).", "special")
    general = read("-clean(A) if wet(A), thing(A).", "general")
    assert grouped([special, general], domain.signature) == [[general, special]]


def test_equal_statements_are_recognised_in_other_words():
    one = axiom("-stable(A) if on(A, B), obj_size(B, small).", "one")
    other = axiom("-stable(X) if obj_size(Y, small), on(X, Y).", "other")
    assert same_statement(one, other, DOMAIN.signature)
    assert not same_statement(one, axiom("-stable(A) if on(A, B)."), DOMAIN.signature)
    (group,) = grouped([one, other], DOMAIN.signature)
    assert len(group) == 2


# --- Strength.


def lived(reinforced, cycles):
    """Strengths per cycle of an axiom that is learned in cycle 1."""
    strength, values = Strength(), [1.0]
    for cycle in range(2, cycles + 1):
        strength = strength.step()
        if cycle in reinforced:
            strength = strength.reinforced()
        values.append(strength.value)
    return values


def test_the_curve_of_the_paper():
    values = lived({2, 3, 4, 5, 6, 9, 10}, 10)
    assert values[:6] == [1.0] * 6
    assert [round(value, 2) for value in values[6:]] == [0.97, 0.94, 1.0, 1.0]


def test_what_is_learned_once_is_forgotten_after_three_cycles():
    values = lived(set(), 4)
    assert values[2] >= FORGOTTEN_BELOW > values[3]


@given(st.lists(st.booleans(), max_size=30))
def test_strength_stays_between_zero_and_one_and_reinforcement_never_harms(events):
    strength = Strength()
    for reinforced in events:
        older = strength
        strength = strength.step()
        assert 0.0 <= strength.value <= older.value
        if reinforced:
            again = strength.reinforced()
            assert again.value == 1.0
            assert again.decay == pytest.approx(strength.decay / math.pow(2, 1 / strength.idle))
            assert again.reinforced() == again
            strength = again
