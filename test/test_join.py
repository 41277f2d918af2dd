"""SceneJoin against a simple model: any order, once, first wins, bounded."""

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from ros_scenesense.stages.join import SceneJoin

SECOND = 1_000_000_000
PARTS = ("scene", "relations", "objects")


@given(st.permutations([(key, part) for key in "abc" for part in PARTS]))
def test_any_order_completes_every_scene_exactly_once(order):
    join = SceneJoin(PARTS, timeout_s=1.0)
    complete = {}
    for key, part in order:
        parts = join.add(key, part, key + part, 0)
        if parts is not None:
            assert key not in complete
            complete[key] = parts
    assert complete == {key: {part: key + part for part in PARTS} for key in "abc"}
    assert join.expired(10 * SECOND) == []


@given(st.permutations([(part, number) for part in PARTS for number in range(3)]))
def test_the_first_of_each_part_wins_and_repeats_are_known(order):
    join = SceneJoin(PARTS, timeout_s=1.0)
    first, complete = {}, []
    for part, number in order:
        assert join.knows("a", part) == (part in first or bool(complete))
        if not complete:
            first.setdefault(part, number)
        parts = join.add("a", part, number, 0)
        complete += [parts] if parts is not None else []
    assert complete == [first]


def test_a_scene_that_waits_too_long_is_given_up_and_may_start_anew():
    join = SceneJoin(PARTS, timeout_s=1.0)
    join.add("a", "scene", 1, 0)
    join.add("b", "objects", 1, SECOND // 2)
    join.add("a", "relations", 2, SECOND)
    assert join.expired(SECOND) == []
    assert join.expired(SECOND + 1) == [("a", ["objects"])]
    assert join.expired(SECOND + 1) == []
    assert not join.knows("a", "scene")
    for part in ("objects", "scene"):
        assert join.add("a", part, 3, 2 * SECOND) is None
    assert join.add("a", "relations", 3, 2 * SECOND) == dict.fromkeys(
        ("objects", "scene", "relations"), 3
    )


def test_the_oldest_scene_makes_room_and_is_reported():
    join = SceneJoin(PARTS, timeout_s=1.0, capacity=2)
    for key in "abc":
        join.add(key, "scene", key, 0)
    assert join.expired(0) == [("a", ["relations", "objects"])]
    assert not join.knows("a", "scene")
    assert join.knows("b", "scene")
    assert join.knows("c", "scene")


def test_of_bulky_parts_few_wait_and_the_others_do_not_push_them_out():
    join = SceneJoin(("image", "scene", "relations"), timeout_s=1.0, capacity=256, bulky=("image",))
    join.add(0, "image", "i", 0)
    for key in range(1, 201):
        join.add(key, "scene", "s", 0)
    assert join.expired(0) == []
    join.add(0, "scene", "s", 0)
    assert join.add(0, "relations", "r", 0) == {"image": "i", "scene": "s", "relations": "r"}
    for key in range(1, 34):
        join.add(key, "image", "i", 0)
    assert join.expired(0) == [(1, ["relations"])]
    assert join.knows(200, "scene")


def test_a_join_of_one_part_is_complete_at_once():
    join = SceneJoin(("scene",), timeout_s=1.0)
    assert join.add("a", "scene", 1, 0) == {"scene": 1}
    assert join.add("a", "scene", 2, 0) is None


def test_finished_scenes_are_forgotten_oldest_first():
    join = SceneJoin(("scene",), timeout_s=1.0, memory=2)
    for key in "abc":
        join.add(key, "scene", 1, 0)
    assert [join.knows(key, "scene") for key in "abc"] == [False, True, True]


def test_a_clock_that_goes_back_keeps_scenes_waiting():
    join = SceneJoin(PARTS, timeout_s=1.0)
    join.add("a", "scene", 1, 10 * SECOND)
    assert join.expired(0) == []
    assert join.expired(12 * SECOND) == [("a", ["relations", "objects"])]


class Flood(RuleBasedStateMachine):
    """Whatever comes, nothing grows without bound and no part of a scene is mixed up."""

    def __init__(self):
        super().__init__()
        self.join = SceneJoin(PARTS, timeout_s=1.0, capacity=3, memory=5)
        self.now_ns = 0
        self.numbers = Counter()

    @rule(key=st.integers(0, 20), part=st.sampled_from(PARTS))
    def add(self, key, part):
        self.numbers[key] += 1
        known = self.join.knows(key, part)
        parts = self.join.add(key, part, (key, part, self.numbers[key]), self.now_ns)
        if parts is not None:
            assert not known
            assert {name: value[:2] for name, value in parts.items()} == {
                name: (key, name) for name in PARTS
            }
            assert self.join.knows(key, part)

    @rule(seconds=st.floats(0.0, 2.0))
    def wait(self, seconds):
        self.now_ns += int(seconds * SECOND)

    @rule()
    def expire(self):
        for key, missing in self.join.expired(self.now_ns):
            assert 0 < len(missing) < len(PARTS)
            assert key in self.numbers

    @invariant()
    def is_bounded(self):
        assert len(self.join._waiting) <= 3
        assert len(self.join._done) <= 5
        assert len(self.join._overflown) <= 5


TestFlood = Flood.TestCase
TestFlood.settings = settings(max_examples=30)


def test_what_was_pushed_out_is_bounded_even_if_nobody_asks():
    join = SceneJoin(PARTS, timeout_s=1.0, capacity=1, memory=10)
    for key in range(1000):
        join.add(key, "scene", None, 0)
    assert len(join.expired(0)) == 10


def test_an_unknown_part_is_a_mistake_of_the_caller():
    join = SceneJoin(PARTS, timeout_s=1.0)
    with pytest.raises(KeyError, match="labels"):
        join.add("a", "labels", 1, 0)


def test_nearest_finds_the_waiting_scene_that_lacks_the_part():
    join = SceneJoin(("a", "b"), timeout_s=1.0)
    for key in (100, 130):
        join.add(key, "a", key, 0)
    assert join.nearest(118, "b", tolerance=20) == 130
    assert join.nearest(112, "b", tolerance=20) == 100
    assert join.nearest(118, "b", tolerance=11) is None
    assert join.nearest(100, "a", tolerance=50) is None
    join.add(130, "b", "done", 0)
    assert join.nearest(118, "b", tolerance=20) == 100
