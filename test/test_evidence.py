"""Evidence on its way from control to grounding: all of it arrives, once, whatever is killed."""

from collections import Counter

import msgspec
import pytest
from grounding_samples import feedback, groundings, record
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.grounding.msr import MetricSettings, Source
from ros_scenesense.messages.grounding import FeedbackResult, MsrUpdate, Relations, Trust
from ros_scenesense.parameters import build
from ros_scenesense.scene import Distance, Position
from ros_scenesense.stages.evidence import evidence_of
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.grounding_store import GroundingStore
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.state_file import IN_MEMORY

SECOND = 1_000_000_000


def control(folder="", **values) -> GroundingControlStage:
    values = {"state_dir": str(folder), **values}
    return GroundingControlStage(build(GroundingControlConfiguration, values))


def updates(published: list) -> list[MsrUpdate]:
    return [item for item in published if isinstance(item, MsrUpdate)]


def test_the_relations_of_a_scene_are_evidence_by_whoever_named_them():
    (update,) = updates(control().handle(groundings(), SECOND))
    assert (update.id, update.first_pending, update.agreement_dropped) == (1, 1, False)
    assert Counter((one.relation, one.source) for one in update.samples) == {
        ("left", "qsr"): 3,
        ("not_touching", "qsr"): 3,
    }


def test_relations_that_are_not_sure_teach_nothing():
    stage = control(evidence_confidence=0.95)
    assert updates(stage.handle(groundings(), SECOND)) == []
    (relations,) = [
        item for item in control().handle(groundings(), SECOND) if isinstance(item, Relations)
    ]
    (one, *_) = relations.relations
    unsure = msgspec.structs.replace(one, position_confidence=0.59)
    relations = msgspec.structs.replace(relations, relations=[unsure])
    assert [[sample.relation for sample in group] for group in evidence_of(relations, 0.6)] == [
        ["not_touching"]
    ]


def test_what_is_not_known_to_be_applied_is_sent_again_more_and_more_rarely():
    stage = control(resend_s=2.0)
    (update,) = updates(stage.handle(groundings(), 100 * SECOND))
    sent = [second for second in range(100, 400) if stage.tick(second * SECOND)]
    assert sent == [103, 108, 117, 134, 167, 228, 289, 350]
    assert stage.tick(500 * SECOND) == [update]
    stage.handle(groundings("s-1", applied_update=1), 501 * SECOND)
    (second,) = stage.tick(504 * SECOND)
    assert (second.id, second.first_pending) == (2, 2)
    stage.handle(groundings("s-1", applied_update=2), 505 * SECOND)
    assert stage.tick(1000 * SECOND) == []


def test_a_scene_of_before_a_restart_gets_the_same_relations_and_no_second_evidence(tmp_path):
    stage = control(tmp_path)
    stage.start(0)
    relations, *rest = stage.handle(groundings(), SECOND)
    stage.close()
    again = control(tmp_path)
    assert updates(again.start(2 * SECOND)) == updates(rest)
    assert again.handle(groundings(), 3 * SECOND) == [relations]
    assert again.handle(groundings(), 4 * SECOND) == []
    (new,) = updates(again.handle(groundings("s-1"), 5 * SECOND))
    assert new.id == 2


def test_trust_is_the_same_after_a_restart(tmp_path):
    stage = control(tmp_path)
    stage.handle(groundings(), SECOND)
    result, trust, *_ = stage.handle(feedback("right a b"), 2 * SECOND)
    stage.close()
    again = control(tmp_path)
    published = again.start(9 * SECOND)
    (after,) = [item for item in published if isinstance(item, Trust)]
    assert msgspec.structs.replace(after, stamp=trust.stamp) == trust
    assert again.handle(feedback("right a b"), 10 * SECOND)[0].outcome == "duplicate"
    assert result.outcome == "accepted"


def test_a_ledger_that_is_younger_than_the_histograms_goes_on_with_their_numbers():
    stage = control()
    (update,) = updates(stage.handle(groundings(applied_update=57), SECOND))
    assert (update.id, update.first_pending) == (58, 58)


def test_a_number_that_cannot_be_true_is_not_believed():
    stage = control()
    (update,) = updates(stage.handle(groundings(applied_update=2**53 - 1), SECOND))
    assert update.id == 1
    assert stage.health.counters["update_unknown"] == 1


def test_histograms_that_are_younger_than_the_ledger_get_what_comes_next():
    stage, store = control(), GroundingStore(IN_MEMORY, Health(), 200, MetricSettings())
    for number in range(5):
        stage.handle(groundings(f"s-{number}", applied_update=number), SECOND)
    (update,) = updates(stage.handle(groundings("s-5", applied_update=5), SECOND))
    assert store.apply(update)
    assert store.applied == 6


class Channel:
    """Control and grounding with files, and a network between them that loses what it is told."""

    def __init__(self, folder) -> None:
        self.folder = folder
        self.now_ns = SECOND
        self.scenes: list[str] = []
        self.start_control()
        self.start_store()

    def start_control(self) -> None:
        self.control = control(self.folder)
        self.deliver(self.control.start(self.now_ns), lost=False)

    def start_store(self) -> None:
        self.store = GroundingStore(self.folder / "grounding.db", Health(), 200, MetricSettings())

    def deliver(self, published: list, lost: bool) -> None:
        for update in [] if lost else updates(published):
            if hasattr(self, "store"):
                self.store.apply(update)

    def show(self, scene_id: str, lost: bool) -> None:
        self.store.record_scene(record(scene_id))
        seen = groundings(scene_id, applied_update=self.store.applied)
        self.deliver(self.control.handle(seen, self.now_ns), lost)
        if scene_id not in self.scenes:
            self.scenes.append(scene_id)

    def say(self, words: str, lost: bool) -> FeedbackResult:
        published = self.control.handle(feedback(words), self.now_ns)
        self.deliver(published, lost)
        return published[0]

    def wait(self, lost: bool) -> None:
        self.now_ns += 100 * SECOND
        self.deliver(self.control.tick(self.now_ns), lost)


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["show", "again", "say", "wait", "kill control", "kill grounding"]),
        st.sampled_from(["left a b", "right a b", "above b c", "touching a c", "far a c"]),
        st.booleans(),
    ),
    max_size=25,
)


@settings(max_examples=25)
@given(STEPS)
def test_no_evidence_is_lost_or_doubled(tmp_path_factory, steps):
    channel = Channel(tmp_path_factory.mktemp("state"))
    standing: dict[tuple, str] = {}
    for step, words, lost in steps:
        match step:
            case "show":
                channel.show(f"s-{len(channel.scenes)}", lost)
            case "again" if channel.scenes:
                channel.show(channel.scenes[0], lost)
            case "say":
                result = channel.say(words, lost)
                if result.outcome == "accepted":
                    relation, *names = words.split()
                    kind = relation in list(Position)
                    standing[result.scene_id, tuple(sorted(names)), kind] = relation
            case "wait":
                channel.wait(lost)
            case "kill control":
                channel.control.close()
                channel.start_control()
            case "kill grounding":
                channel.store.close()
                channel.start_store()
    channel.wait(lost=False)
    assert channel.store.applied == channel.control._ledger.last_update()
    counts = channel.store.memory.model.counts
    relations = [*Position, *Distance]
    scenes = len(channel.scenes)
    by_machine = counts[:, [list(Source).index(one) for one in (Source.QSR, Source.MSR)]].sum()
    # Three pairs, each with a position and a distance, each from both sides.
    assert by_machine == 12 * scenes
    told = Counter()
    for relation in standing.values():
        position = relation in list(Position)
        told[relation] += 1
        told[Position(relation).converse.value if position else relation] += 1
    human = counts[:, list(Source).index(Source.HUMAN)]
    assert {one.value: int(human[row]) for row, one in enumerate(relations) if human[row]} == told
    channel.control.close()
    channel.store.close()


@pytest.mark.parametrize("least", [0.0, 1.0])
def test_confidence_is_from_0_to_1(least):
    groups = evidence_of(control().handle(groundings(), SECOND)[0], least)
    assert bool(groups) == (least < 0.9)
