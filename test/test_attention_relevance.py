"""Which relations bear on a task is read off the axioms, also off those learned a moment ago."""

import pytest
from test_attention_regions import BOXES, RELATIONS, SIZE, relation

from ros_scenesense.attention.regions import regions
from ros_scenesense.attention.relevance import relevance
from ros_scenesense.knowledge.action_language import load, parse
from ros_scenesense.resources import resource
from ros_scenesense.scene import Position, Task

WITHHELD = {"s1", "s2", "s3", "o1", "o2", "o3"}


@pytest.fixture(scope="module")
def domain():
    return load(resource("asp", "robot_assistant.al")).description


def patterns(description, task):
    return {"+".join(sorted(each)) for each in relevance(description, task).patterns}


def test_definitions_stand_for_the_relations_in_them(domain):
    # Large on small, and the height of a tower: on is above and touching; what is in, is level.
    known = domain.without(WITHHELD)
    assert patterns(known, Task.STABILITY) == {"above+touching", "in"}
    assert relevance(known, Task.STABILITY).axioms == ("large_on_small", "tall_tower")


def test_what_an_axiom_denies_counts_too(domain):
    assert patterns(domain.without(WITHHELD - {"s1"}), Task.STABILITY) == {
        "above",
        "above+touching",
        "in",
    }
    assert patterns(domain.without({"o2", "o3"}), Task.OCCLUSION) == {"behind"}
    assert patterns(domain, Task.OCCLUSION) == {"behind", "above"}


def test_without_an_axiom_every_position_counts(domain):
    found = relevance(domain.without(WITHHELD), Task.OCCLUSION)
    assert found.axioms == ()
    assert set(found.relations) == {str(position) for position in Position}


def test_pairs_are_found_in_either_direction(domain):
    found = relevance(domain.without({"o2", "o3"}), Task.OCCLUSION)
    relations = [
        relation("a", "front", "b"),
        relation("c", "behind", "b"),
        relation("a", "in", "c"),
    ]
    assert list(found.pairs(relations)) == [("a", "b"), ("c", "b")]


def test_the_papers_figure_of_two_regions(domain):
    # (a) duck, can and cube are looked at for stability, mug and pitcher are not.
    stability = relevance(domain, Task.STABILITY)
    (roi,) = regions(stability, RELATIONS, {"duck", "red_can"}, BOXES, SIZE)
    assert roi.objects == ["duck", "red_can", "white_cube"]
    # (b) mug, can and cube are looked at for occlusion.
    occlusion = relevance(domain.without({"o2", "o3"}), Task.OCCLUSION)
    (roi,) = regions(occlusion, RELATIONS, {"red_can", "white_cube"}, BOXES, SIZE)
    assert roi.objects == ["mug", "red_can", "white_cube"]


def test_a_learned_axiom_changes_the_regions_without_a_change_of_code(domain):
    before = relevance(domain.without({"o2", "o3"}), Task.OCCLUSION)
    (roi,) = regions(before, RELATIONS, {"pitcher"}, BOXES, SIZE)
    assert roi.objects == ["pitcher"]
    known = domain.without({"o2", "o3"})
    learned = parse("l1: occluded(A) if right(A, B), touching(A, B).", "learned", known)
    after = relevance(learned.description, Task.OCCLUSION)
    assert after.axioms == ("o1", "l1")
    touching = [*RELATIONS, relation("pitcher", "right", "tray", "touching")]
    boxes = BOXES | {"tray": BOXES["mug"]}
    (roi,) = regions(after, touching, {"pitcher"}, boxes, SIZE)
    assert roi.objects == ["pitcher", "tray"]
