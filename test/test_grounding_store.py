"""grounding.db: evidence is merged once, in order, can be taken back, and survives a restart."""

import io
import math
import sqlite3

import numpy as np
import pytest
from grounding_samples import NAMES, record, sample, update
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.grounding.msr import MetricSettings, Source
from ros_scenesense.scene import Distance, Position
from ros_scenesense.stages.grounding_store import GroundingStore
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.state_file import IN_MEMORY

POSITIONS = list(Position)


def store(path=IN_MEMORY, remembered: int = 10) -> GroundingStore:
    opened = GroundingStore(path, Health(), remembered, MetricSettings())
    opened.health = opened._health
    return opened


def counts(one: GroundingStore, relation: Position | Distance) -> list[int]:
    """Examples of a relation by source: QSR, MSR, human."""
    row = [*Position, *Distance].index(relation)
    return one.memory.model.counts[row].tolist()


def seen_left(scene) -> int:
    """The bin in which a was seen from b."""
    return scene.example(sample("left a b")).forward.position.argmax()


def arrays(one: GroundingStore) -> dict:
    return one.memory.to_arrays()


def assert_same(first: dict, second: dict) -> None:
    assert first.keys() == second.keys()
    for name in first:
        np.testing.assert_allclose(first[name], second[name], atol=1e-12, err_msg=name)


def test_evidence_teaches_both_directions_of_a_pair():
    one = store()
    one.record_scene(record())
    assert one.apply(update(1, sample("left a b", source="qsr"), sample("touching a c")))
    assert one.applied == 1
    assert counts(one, Position.LEFT) == counts(one, Position.RIGHT) == [1, 0, 0]
    assert counts(one, Distance.TOUCHING) == [0, 0, 2]
    meaning = one.memory.model.position_histogram(Position.LEFT)
    assert meaning.argmax() == seen_left(record())


def test_an_update_is_applied_once_and_in_order():
    one = store()
    one.record_scene(record())
    updates = [update(number, sample(f"left a {name}")) for number, name in ((1, "b"), (2, "c"))]
    assert not one.apply(updates[1])
    assert one.apply(updates[0])
    assert not one.apply(updates[0])
    assert one.apply(updates[1])
    assert not one.apply(updates[1])
    assert counts(one, Position.LEFT) == [0, 0, 2]
    assert not one.health.counters


def test_what_nobody_will_send_any_more_is_not_waited_for():
    one = store()
    one.record_scene(record())
    assert one.apply(update(58, sample("left a b"), first_pending=58))
    ((kind, words),) = one.health.take_problems()
    assert kind == "evidence_lost"
    assert "updates 1 to 57" in words
    assert one.apply(update(59, sample("left a c"), first_pending=58))
    assert one.applied == 59


def test_a_pair_of_a_scene_is_evidence_once_whoever_repeats_it():
    one = store()
    one.record_scene(record())
    one.apply(update(1, sample("left a b", source="qsr")))
    again = (sample("left a b", source="qsr"), sample("right b a", source="msr"))
    one.apply(update(2, *again, sample("touching a b", source="qsr")))
    assert counts(one, Position.LEFT) == [1, 0, 0]
    assert counts(one, Distance.TOUCHING) == [2, 0, 0]


def test_evidence_of_what_is_not_there_is_counted_and_the_rest_applied():
    one = store(remembered=1)
    one.record_scene(record("s-0"))
    one.record_scene(record("s-1"))
    wrong = ("left a b", "s-0"), ("left a b", "nowhere"), ("left a x", "s-1"), ("left a a", "s-1")
    by_machine = [sample(*words, "qsr") for words in wrong]
    by_people = [sample(*words) for words in wrong]
    assert one.apply(update(1, *by_machine, *by_people, sample("left a b", "s-1")))
    assert one.health.counters["evidence_without_scene"] == len(wrong)
    assert [kind for kind, _ in one.health.take_problems()] == ["word_without_scene"] * len(wrong)
    assert counts(one, Position.LEFT) == [0, 0, 1]


def test_the_first_record_of_a_scene_counts_and_repeats_push_none_out():
    one = store(remembered=2)
    for scene_id in ("s-0", "s-1", "s-1", "s-1"):
        one.record_scene(record(scene_id))
    one.record_scene(record("s-0", azimuth_rad=0.0))
    one.apply(update(1, sample("left a b", "s-0")))
    meaning = one.memory.model.position_histogram(Position.LEFT)
    assert meaning.argmax() == seen_left(record())


def test_what_a_person_takes_back_leaves_no_trace():
    one, other = store(), store()
    for each in (one, other):
        each.record_scene(record("s-0"))
        each.record_scene(record("s-1", azimuth_rad=0.5))
        each.apply(update(1, sample("behind a c", "s-0", "qsr"), sample("left b c", "s-1", "msr")))
    one.apply(update(2, sample("right a b")))
    one.apply(update(3, sample("above a c", "s-1")))
    one.apply(update(4, sample("left a b")))
    other.apply(update(2))
    other.apply(update(3, sample("above a c", "s-1")))
    other.apply(update(4, sample("left a b")))
    assert_same(arrays(one), arrays(other))


@pytest.mark.parametrize("moved", [True, False])
@pytest.mark.parametrize(
    "words",
    [
        [("front", "s-1"), ("behind", "s-1")],
        [("front", "s-1"), ("behind", "s-2"), ("behind", "s-1")],
    ],
    ids=["the last word", "an earlier word"],
)
def test_that_the_camera_moved_is_known_though_words_are_taken_back(words, moved):
    """So few words prove another angle only if the camera is known to have moved."""
    one = store()
    for number in range(3):
        one.record_scene(record(f"s-{number}"))
    if moved:
        assert one.expect_change()
    for number, (relation, scene_id) in enumerate(words, 1):
        one.apply(update(number, sample(f"{relation} a b", scene_id)))
    yaw_deg = math.degrees(one.memory.yaw_rad)
    assert yaw_deg == pytest.approx(90.0 if moved else 0.0, abs=15.0)


def test_what_is_said_outlives_its_scene_and_can_still_be_learned_anew():
    one, other = store(remembered=2), store(remembered=2)
    for each in (one, other):
        each.record_scene(record("s-0"))
    one.apply(update(1, sample("left a b", "s-0")))
    other.apply(update(1, sample("left a b", "s-0")))
    for each in (one, other):
        each.record_scene(record("s-1"))
        each.record_scene(record("s-2"))
    one.apply(update(2, sample("front a b", "s-2")))
    one.apply(update(3, sample("left a b", "s-2")))
    other.apply(update(2))
    other.apply(update(3, sample("left a b", "s-2")))
    assert_same(arrays(one), arrays(other))
    assert counts(one, Position.LEFT) == [0, 0, 2]


UPDATES = st.lists(
    st.lists(
        st.builds(
            lambda relation, pair, scene, source: sample(
                f"{relation} {pair[0]} {pair[1]}", scene, source
            ),
            st.sampled_from([*Position, *Distance]),
            st.permutations(NAMES),
            st.sampled_from(["s-0", "s-1", "s-2"]),
            st.sampled_from([one.value for one in Source]),
        ),
        max_size=3,
    ),
    min_size=1,
    max_size=6,
)


@settings(max_examples=25)
@given(UPDATES, st.data())
def test_restarts_and_repeats_change_nothing(tmp_path_factory, groups, data):
    updates = [update(number, *group) for number, group in enumerate(groups, 1)]
    scenes = [record(f"s-{number}", azimuth_rad=float(number)) for number in range(3)]
    plain = store()
    for scene in scenes:
        plain.record_scene(scene)
    for one in updates:
        assert plain.apply(one)
    path = tmp_path_factory.mktemp("state") / "grounding.db"
    tried = store(path)
    for scene in scenes:
        tried.record_scene(scene)
    while tried.applied < len(updates):
        awaited = updates[tried.applied]
        for one in [*data.draw(st.lists(st.sampled_from(updates), max_size=4)), awaited]:
            tried.apply(one)
        if data.draw(st.booleans()):
            tried.close()
            tried = store(path)
            tried.record_scene(scenes[0])
    assert_same(arrays(plain), arrays(tried))


def test_a_crash_within_an_update_leaves_what_was_before(tmp_path, monkeypatch):
    path = tmp_path / "grounding.db"
    one = store(path)
    one.record_scene(record())
    one.apply(update(1, sample("left a b")))
    before = arrays(one)

    def killed(*_arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("ros_scenesense.stages.grounding_store._memory_bytes", killed)
    with pytest.raises(KeyboardInterrupt):
        one.apply(update(2, sample("front a b"), sample("above a c")))
    monkeypatch.undo()
    assert_same(arrays(one), before)
    again = store(path)
    assert again.applied == 1
    assert_same(arrays(again), before)
    assert again.apply(update(2, sample("front a b")))
    assert counts(again, Position.FRONT) == [0, 0, 1]
    assert counts(again, Position.LEFT) == [0, 0, 0]


def test_a_file_that_cannot_be_written_is_a_problem_and_no_crash(tmp_path):
    path = tmp_path / "grounding.db"
    one = store(path)
    one.record_scene(record())
    other = sqlite3.connect(path, isolation_level=None)
    one._connection.execute("PRAGMA busy_timeout = 10")
    other.execute("BEGIN IMMEDIATE")
    assert not one.apply(update(1, sample("left a b")))
    one.record_scene(record("s-1"))
    assert [kind for kind, _ in one.health.take_problems()] == ["not_remembered"] * 2
    other.execute("ROLLBACK")
    assert one.applied == 0
    assert one.apply(update(1, sample("left a b")))


def _blob(**arrays) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


@pytest.mark.parametrize(
    "blob", [b"", b"nonsense", _blob(), _blob(counts=np.zeros((2, 2)))], ids=len
)
def test_a_file_with_nonsense_in_it_is_set_aside(tmp_path, blob):
    path = tmp_path / "grounding.db"
    store(path).close()
    with sqlite3.connect(path) as connection:
        connection.execute("INSERT OR REPLACE INTO learned VALUES (1, 7, ?)", (blob,))
    connection.close()
    again = store(path)
    assert again.health.counters["state_set_aside"] == 1
    assert again.applied == 0
    assert (tmp_path / "grounding.db.broken-1").exists()


def test_that_the_camera_moved_is_remembered(tmp_path):
    one = store(tmp_path / "grounding.db")
    assert one.expect_change()
    one.close()
    again = store(tmp_path / "grounding.db")
    expected = again.memory.to_arrays()["yaw"]
    assert expected.tolist() == [0.0, 0.0, 1.0]
    assert again.applied == 0
    again.record_scene(record())
    assert again.apply(update(1, sample("left a b")))
    assert again.memory.to_arrays()["yaw"][2] == 0.0


def test_that_the_camera_moved_cannot_be_written():
    one = store()
    one._connection.execute("DROP TABLE learned")
    assert not one.expect_change()
    ((kind, words),) = one.health.take_problems()
    assert kind == "not_remembered"
    assert "camera moved" in words


def test_taking_a_word_back_does_not_forget_that_the_camera_moved():
    one = store()
    for number in range(1, 7):
        one.record_scene(record(f"s-{number}"))
        if number == 5:
            assert one.expect_change()
        words = "left a b" if number < 5 else "behind a b"
        assert one.apply(update(number, sample(words, f"s-{number}")))
    turned = one.memory.yaw_rad
    assert abs(turned) > 0.5
    assert one.apply(update(7, sample("behind a b", "s-1")))
    assert one.memory.yaw_rad == pytest.approx(turned, abs=0.3)
