"""The control stage: trust at the start, relations per scene, repeats and bad pairs."""

import msgspec
import pytest

from ros_scenesense.errors import ParameterError
from ros_scenesense.grounding.trust import Kind
from ros_scenesense.messages.base import AnyMessage, Stamp
from ros_scenesense.messages.codec import encode
from ros_scenesense.messages.grounding import (
    Grounding,
    Groundings,
    MsrUpdate,
    Objects,
    PairGrounding,
    Relations,
    Trust,
)
from ros_scenesense.parameters import build
from ros_scenesense.scene import Distance, NamingFrame, Position
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.protocol import Figure, Timing


def control(**values) -> GroundingControlStage:
    return GroundingControlStage(build(GroundingControlConfiguration, values))


def pair(first: str, second: str, position: Position) -> PairGrounding:
    said = Grounding(
        position=position,
        position_confidence=0.8,
        distance=Distance.TOUCHING,
        distance_confidence=1.0,
    )
    return PairGrounding(object=first, reference=second, qsr=said)


def groundings(*pairs: PairGrounding, scene_id: str = "s-0001") -> Groundings:
    return Groundings(
        stamp=Stamp.of(42), scene_id=scene_id, naming_frame=NamingFrame.VIEWER, pairs=list(pairs)
    )


TWO = (pair("cup", "box", Position.ABOVE), pair("box", "cup", Position.BELOW))


def test_trust_is_published_at_the_start():
    stage = control(mode="switch")
    trust, *figures = stage.start(7)
    assert isinstance(trust, Trust)
    assert (trust.stamp, trust.revision, trust.mode) == (Stamp.of(7), 0, "switch")
    assert (trust.qsr, trust.msr, trust.feedback_count) == (0.9, 0.1, 0)
    assert [one.kind for one in trust.kinds] == list(Kind)
    assert all((one.qsr, one.msr) == (0.9, 0.1) for one in trust.kinds)
    assert Figure("grounding_control/trust_qsr", 0.9) in figures
    assert Figure("grounding_control/trust_msr_horizontal", 0.1) in figures
    assert stage.engine() is None


def test_groundings_become_relations_that_carry_the_trust():
    stage = control(trust_qsr=0.7)
    trust, *_ = stage.start(7)
    relations, timing, *_ = stage.handle(groundings(*TWO), 50)
    assert isinstance(relations, Relations)
    assert (relations.scene_id, relations.stamp, relations.naming_frame) == (
        "s-0001",
        Stamp.of(42),
        NamingFrame.VIEWER,
    )
    assert (relations.trust_qsr, relations.trust_msr) == (trust.qsr, trust.msr) == (0.7, 0.1)
    assert relations.trust_revision == trust.revision
    (relation,) = relations.relations
    assert (relation.object, relation.position, relation.reference) == ("box", "below", "cup")
    assert relation.distance is Distance.TOUCHING
    assert isinstance(timing, Timing)
    assert timing.name == "grounding_control/control"
    encode(relations)


def test_a_scene_without_pairs_gets_empty_relations():
    relations, *_ = control().handle(groundings(), 50)
    assert relations.relations == []


def test_the_first_groundings_of_a_scene_count():
    stage = control()
    assert stage.handle(groundings(*TWO), 50)
    assert stage.handle(groundings(), 60) == []
    assert stage.handle(groundings(scene_id="s-0002"), 60)
    assert stage.health.counters["repeated"] == 1


def test_disagreements_are_counted():
    stage = control()
    relations, *_ = stage.handle(
        groundings(pair("a", "b", Position.LEFT), pair("b", "a", Position.FRONT)), 50
    )
    assert relations.disagreements == stage.health.counters["disagreements"] == 1


def test_improper_pairs_are_ignored_with_one_problem():
    stage = control()
    relations, *_ = stage.handle(
        groundings(
            pair("a", "b", Position.LEFT),
            pair("a", "b", Position.ABOVE),
            pair("a", "a", Position.IN),
        ),
        50,
    )
    assert [one.position for one in relations.relations] == [Position.LEFT]
    ((kind, words),) = stage.health.take_problems()
    assert kind == "pairs_refused"
    assert "s-0001" in words
    assert "2 pairs, first a and b" in words


def test_other_messages_are_none_of_its_business():
    stage = control()
    objects = Objects(stamp=Stamp.of(1), scene_id="s", frame_id="f", objects=[])
    assert stage.handle(objects, 1) == []
    assert stage.tick(2) == []
    assert stage.jobs() == []
    assert not stage.health.counters


def test_the_largest_scene_with_the_longest_names_fits_its_topic():
    # JSON writes a control character in six bytes: no names are longer.
    names = ["\x01" * 62 + f"{number:02d}" for number in range(40)]
    pairs = [pair(a, b, Position.BEHIND) for a in names for b in names if a != b]
    published = control().handle(groundings(*pairs, scene_id="\x01" * 128), 50)
    assert len(published[0].relations) == 40 * 39 / 2
    samples = [one for item in published if type(item) is MsrUpdate for one in item.samples]
    assert len(samples) == 40 * 39
    for item in published:
        if isinstance(item, AnyMessage):
            encode(item)


def test_trust_is_a_probability():
    with pytest.raises(ParameterError, match="trust_msr"):
        control(trust_msr=1.5)


def test_directions_of_the_viewer_go_with_those_of_turned_axes():
    def turned(first: str, second: str, position: Position, viewed: Position | None):
        return msgspec.structs.replace(pair(first, second, position), viewer_position=viewed)

    relations, *_ = control().handle(
        groundings(
            turned("a", "b", Position.LEFT, Position.BEHIND),
            turned("a", "c", Position.ABOVE, Position.BEHIND),
            turned("b", "c", Position.LEFT, Position.ABOVE),
            turned("c", "d", Position.FRONT, None),
        ),
        50,
    )
    found = {(one.object, one.reference): one.viewer_position for one in relations.relations}
    assert found == {
        ("a", "b"): Position.BEHIND,
        ("a", "c"): None,
        ("b", "c"): None,
        ("c", "d"): None,
    }
