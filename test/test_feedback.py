"""What people say: what counts, what is refused with which reason, and what it changes."""

import sqlite3

import msgspec
import pytest
from grounding_samples import NAMES, feedback, groundings
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from message_strategies import messages

from ros_scenesense.grounding.control import Control
from ros_scenesense.grounding.trust import TrustSettings
from ros_scenesense.messages.base import AnyMessage, Stamp
from ros_scenesense.messages.codec import encode
from ros_scenesense.messages.grounding import (
    Feedback,
    FeedbackResult,
    Groundings,
    MsrUpdate,
    Relations,
    Trust,
)
from ros_scenesense.parameters import build
from ros_scenesense.scene import Distance, Position
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.protocol import Figure
from ros_scenesense.stages.statements import Statement

SECOND = 1_000_000_000


def control(**values) -> GroundingControlStage:
    return GroundingControlStage(build(GroundingControlConfiguration, values))


def told(stage: GroundingControlStage, words: str, scene_id=None, id="") -> FeedbackResult:
    return stage.handle(feedback(words, scene_id, id), SECOND)[0]


def only(kind: type, published: list) -> list:
    return [item for item in published if isinstance(item, kind)]


@pytest.fixture
def stage():
    """A stage that has seen two scenes: QSR says left, MSR says right, of a and b, a and c, …"""
    one = control()
    one.start(0)
    one.handle(groundings("s-0"), SECOND)
    one.handle(groundings("s-1", names=("a", "b", "d")), SECOND)
    return one


def test_feedback_that_counts_is_answered_moves_trust_and_is_sent_as_evidence(stage):
    published = stage.handle(feedback("right a b", "s-0", "mine"), 5 * SECOND)
    (result,) = only(FeedbackResult, published)
    assert (result.id, result.outcome, result.scene_id) == ("mine", "accepted", "s-0")
    assert "right(a, b) counts" in result.reason
    assert "QSR had said otherwise; MSR had said the same" in result.reason
    (trust,) = only(Trust, published)
    assert (trust.revision, trust.feedback_count) == (1, 1)
    assert trust.qsr < 0.9
    assert trust.msr > 0.1
    horizontal = next(one for one in trust.kinds if one.kind == "horizontal")
    vertical = next(one for one in trust.kinds if one.kind == "vertical")
    assert horizontal.qsr < vertical.qsr == 0.9
    (update,) = only(MsrUpdate, published)
    (sample,) = update.samples
    assert (sample.scene_id, sample.relation, sample.source) == ("s-0", "right", "human")
    assert (sample.object, sample.reference) == ("a", "b")
    figures = {one.name: one.value for one in only(Figure, published)}
    assert figures["grounding_control/trust_qsr"] == trust.qsr
    assert figures["grounding_control/recent_agreement"] == 0.0


def test_agreement_of_the_relations_with_people_can_be_plotted(stage):
    told(stage, "left a b", "s-0")
    published = stage.handle(feedback("right a c", "s-0"), SECOND)
    figures = {one.name: one.value for one in only(Figure, published)}
    assert figures["grounding_control/recent_agreement"] == 0.5


@pytest.mark.parametrize(
    ("words", "scene_id"),
    [("left a b", "s-1"), ("left a c", "s-0"), ("not_touching b d", "s-1")],
)
def test_without_a_scene_id_it_is_about_the_newest_scene_with_both(stage, words, scene_id):
    result = told(stage, words)
    assert (result.outcome, result.scene_id) == ("accepted", scene_id)


@pytest.mark.parametrize(
    ("words", "scene_id", "reason"),
    [
        ("left a a", None, "no relation to itself"),
        ("left a a", "s-0", "no relation to itself"),
        ("left mug b", None, "'mug' was located in none of the last 2 scenes; in the newest, s-1"),
        ("left mug can", None, "'mug' and 'can' was located in none"),
        ("left c d", None, "'c' and 'd' were located in no scene together"),
        ("left a d", "s-0", "'d' is not located in scene s-0; located are: a, b, c"),
        ("left a b", "s-7", "scene s-7 is unknown, the newest is s-1"),
    ],
)
def test_what_cannot_be_judged_is_refused_with_the_reason(stage, words, scene_id, reason):
    published = stage.handle(feedback(words, scene_id), SECOND)
    (result,) = published
    assert result.outcome == "refused"
    assert reason in result.reason
    assert result.id.startswith("content-")
    assert stage.health.counters["feedback_refused"] == 1


def test_the_time_that_a_person_gives_is_the_feedbacks(stage):
    said = msgspec.structs.replace(feedback("left a b"), stamp=Stamp.of(7))
    result, trust, *_ = stage.handle(said, 9 * SECOND)
    assert (result.stamp, trust.stamp) == (Stamp.of(9 * SECOND), Stamp.of(7))


@settings(max_examples=60, suppress_health_check=list(HealthCheck))
@given(
    st.lists(
        st.one_of(messages(Groundings), messages(Feedback), st.just(groundings())),
        min_size=1,
        max_size=5,
    )
)
def test_whatever_is_a_message_is_judged_and_what_is_published_is_one(items):
    stage = control()
    for item in items:
        for published in stage.handle(item, SECOND):
            if isinstance(published, AnyMessage):
                encode(published)
    assert not stage.health.counters["not_remembered"]
    stage.close()


def test_before_the_first_scene_feedback_is_refused():
    assert told(control(), "left a b").reason == "no scene was seen yet"
    assert told(control(), "left a b", "s-0").reason == "no scene was seen yet"


def test_feedback_that_comes_too_late_is_refused():
    stage = control(remembered_scenes=2)
    for number in range(4):
        stage.handle(groundings(f"s-{number}"), SECOND)
    result = told(stage, "left a b", "s-1")
    assert result.outcome == "refused"
    assert result.reason == "scene s-1 is too old: of the last 2 scenes, the oldest is s-2"
    assert told(stage, "left a b", "s-2").outcome == "accepted"


def test_a_refused_feedback_may_come_again_with_the_same_id(stage):
    assert told(stage, "left a c", "s-2", "mine").outcome == "refused"
    stage.handle(groundings("s-2"), SECOND)
    assert told(stage, "left a c", "s-2", "mine").outcome == "accepted"


@pytest.mark.parametrize(
    ("first", "second", "reason"),
    [
        (("left a b",), ("left a b",), "left(a, b) was said of this scene before"),
        (("left a b",), ("right b a",), "left(a, b) was said of this scene before"),
        (("touching a b",), ("touching b a",), "touching(a, b) was said"),
        (("in b a",), ("in b a",), "in(b, a) was said"),
        (("left a b", "s-1", "x"), ("left a b", "s-1", "x"), "came with this id before"),
        (("left a b", "s-1", "x"), ("left a b", "s-1", "y"), "was said of this scene before"),
        (("left a b", "s-1", "x"), ("above a d", "s-1", "x"), "came with left(a, b) before"),
        (("left a b", "s-1", "x"), ("left a b", "s-0", "x"), "came with left(a, b) before"),
    ],
)
def test_the_same_again_counts_once(stage, first, second, reason):
    assert told(stage, *first).outcome == "accepted"
    published = stage.handle(feedback(*second), SECOND)
    (result,) = published
    assert result.outcome == "duplicate"
    assert reason in result.reason


def test_the_same_of_another_scene_counts_again(stage):
    assert told(stage, "left a b", "s-0").outcome == "accepted"
    assert told(stage, "left a b", "s-1").outcome == "accepted"


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("right a b", "left a b"),
        ("left b a", "left a b"),
        ("in a b", "above a b"),
        ("in a b", "in b a"),
        ("far a b", "touching a b"),
    ],
)
def test_who_says_otherwise_corrects_what_was_said(stage, first, second):
    plain = control()
    for scene in (groundings("s-0"), groundings("s-1", names=("a", "b", "d"))):
        plain.handle(scene, SECOND)
    for one in (stage, plain):
        told(one, "above a c", "s-0")
    told(stage, first, "s-0")
    result = told(stage, second, "s-0")
    assert result.outcome == "accepted"
    assert (
        f"{Statement.of(feedback(first))}, which was said before, no longer does" in result.reason
    )
    told(plain, second, "s-0")
    assert stage.control.state == plain.control.state


def test_position_and_distance_of_a_pair_are_told_apart(stage):
    assert told(stage, "left a b", "s-0").outcome == "accepted"
    assert told(stage, "touching a b", "s-0").outcome == "accepted"
    assert stage.control.state.feedback_count == 2


def test_a_changed_mind_may_change_back(stage):
    for words in ("left a b", "right a b", "left a b"):
        assert told(stage, words, "s-0").outcome == "accepted"
    assert told(stage, "left a b", "s-0").outcome == "duplicate"
    assert stage.control.state.feedback_count == 1


@pytest.mark.parametrize("mode", ["switch", "arbiter"])
def test_the_grounding_that_people_agree_with_names_the_relations(mode):
    stage = control(mode=mode)
    for number in range(12):
        (relations,) = only(Relations, stage.handle(groundings(f"s-{number}"), SECOND))
        told(stage, "right a b", f"s-{number}")
        told(stage, "right b c", f"s-{number}")
    assert {one.position for one in relations.relations} == {Position.RIGHT}
    assert {one.position_source for one in relations.relations} == {"msr"}
    assert relations.trust_msr > relations.trust_qsr


def test_a_drop_of_agreement_is_told_to_people_and_to_grounding():
    stage = control()
    published = []
    for number in range(30):
        scene_id = f"s-{number}"
        stage.handle(groundings(scene_id), SECOND)
        published += stage.handle(
            feedback("left a b" if number < 20 else "front a b", scene_id), SECOND
        )
    changed = [one.viewpoint_changed for one in only(Trust, published)]
    assert not any(changed[:20])
    first = changed.index(True)
    (dropped,) = [one for one in only(MsrUpdate, published) if one.agreement_dropped][:1]
    assert dropped.samples[0].scene_id == f"s-{first}"
    result = only(FeedbackResult, published)[first]
    assert "the viewpoint seems to have changed" in result.reason


def test_a_ledger_that_cannot_be_written_refuses_and_keeps_the_trust(tmp_path, stage):
    stage = control(state_dir=str(tmp_path))
    stage.handle(groundings("s-0"), SECOND)
    stage._ledger._connection.execute("PRAGMA busy_timeout = 10")
    other = sqlite3.connect(tmp_path / "control.db", isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    before = stage.control.state
    result = told(stage, "right a b")
    assert result.outcome == "refused"
    assert "could not be written" in result.reason
    assert stage.control.state == before
    relations = only(Relations, stage.handle(groundings("s-1", applied_update=1), SECOND))
    assert len(relations) == 1
    assert stage.health.counters["not_remembered"] == 3
    other.execute("ROLLBACK")
    assert told(stage, "right a b").outcome == "accepted"


SCENES = ("s-0", "s-1", "s-2")
STATEMENTS = st.tuples(
    st.sampled_from([*Position, *Distance]),
    st.permutations(NAMES),
    st.sampled_from(SCENES),
    st.sampled_from(["", "", "x", "y", "z"]),
)


@settings(max_examples=25)
@given(st.lists(STATEMENTS, max_size=14), st.data())
def test_what_counts_is_the_last_word_on_each_pair_whatever_happens_between(
    tmp_path_factory, statements, data
):
    """The ledger against a dictionary: restarts and repeats make no difference."""
    folder = str(tmp_path_factory.mktemp("state"))
    stage = control(state_dir=folder)
    for scene_id in SCENES:
        stage.handle(groundings(scene_id), SECOND)
    standing: dict[tuple, Statement] = {}
    ids: set[str] = set()
    for relation, names, scene_id, id in statements:
        said = feedback(f"{relation} {names[0]} {names[1]}", scene_id, id)
        statement = Statement.of(said)
        key = (scene_id, statement.pair, statement.kind)
        is_duplicate = id in ids or standing.get(key) == statement
        result = stage.handle(said, SECOND)[0]
        assert result.outcome == ("duplicate" if is_duplicate else "accepted")
        if not is_duplicate:
            standing.pop(key, None)
            standing[key] = statement
            ids |= {id} - {""}
        if data.draw(st.booleans()):
            stage.close()
            stage = control(state_dir=folder)
    reference = Control("arbiter", TrustSettings())
    scene = groundings()
    by_names = {(one.object, one.reference): one for one in scene.pairs}
    for statement in standing.values():
        names = (statement.object, statement.reference)
        reference.learn(statement.relation, by_names[names], by_names[names[::-1]])
    assert stage.control.state == reference.state
    humans = [
        sample
        for update in stage._ledger.pending()
        for sample in update.samples
        if sample.source == "human"
    ]
    last = {
        (one.scene_id, frozenset((one.object, one.reference)), one.relation in list(Position)): one
        for one in humans
    }
    assert {(one.relation, one.object, one.reference, one.scene_id) for one in last.values()} == {
        (one.relation, one.object, one.reference, key[0]) for key, one in standing.items()
    }
    stage.close()


def test_a_scene_that_cannot_be_read_is_reported_and_its_feedback_refused(tmp_path):
    stage = control(state_dir=str(tmp_path))
    stage.handle(groundings("s-0"), SECOND)
    with sqlite3.connect(tmp_path / "control.db") as connection:
        connection.execute("UPDATE content SET groundings = x'00', relations = x'00'")
    connection.close()
    assert told(stage, "left a b").outcome == "refused"
    assert stage.health.counters["state_unreadable"] == 1
    stage.close()
    again = control(state_dir=str(tmp_path))
    assert again.handle(groundings("s-0"), SECOND) == []
    assert again.health.counters["state_unreadable"] == 1


@pytest.mark.parametrize(
    "damage",
    [
        "UPDATE trust SET message = '{}'",
        "UPDATE msr_update SET message = 'nonsense'",
        "UPDATE feedback SET grounded = '[]'",
        "UPDATE feedback SET relation = 'beside'",
    ],
)
def test_a_ledger_with_nonsense_in_it_is_set_aside(tmp_path, damage):
    stage = control(state_dir=str(tmp_path))
    stage.handle(groundings("s-0"), SECOND)
    told(stage, "right a b")
    stage.close()
    with sqlite3.connect(tmp_path / "control.db") as connection:
        connection.execute(damage)
    connection.close()
    again = control(state_dir=str(tmp_path))
    assert again.health.counters["state_set_aside"] == 1
    assert (tmp_path / "control.db.broken-1").exists()
    assert again.control.state.feedback_count == 0
