"""The markers of a scene: old ones deleted, a box and name per object, arrows where near."""

import pytest
from visualization_msgs.msg import Marker

from ros_scenesense.geometry import Box, Pose
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Objects, PerceivedObject, Relation, Relations
from ros_scenesense.messages.reasoning import Belief, Beliefs, ObjectBelief
from ros_scenesense.nodes.markers import markers_of
from ros_scenesense.scene import DecisionStatus, Distance, NamingFrame, Position

SCENE = {"stamp": Stamp(7, 8), "scene_id": "s-0"}
UNDECIDED = Belief(status=DecisionStatus.UNDECIDED)


def box(x: float) -> Box:
    return Box(pose=Pose((x, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)), size=(0.1, 0.2, 0.3))


def objects(*names: str, hidden: tuple[str, ...] = ()) -> Objects:
    members = [
        PerceivedObject(
            instance=number, name=name, points=9, box=None if name in hidden else box(number)
        )
        for number, name in enumerate(names, start=1)
    ]
    return Objects(**SCENE, frame_id="camera", objects=members)


def relations(*triples: tuple[str, str, Distance]) -> Relations:
    members = [
        Relation(
            object=one,
            reference=other,
            position=Position.LEFT,
            position_confidence=1.0,
            position_source="qsr",
            distance=distance,
            distance_confidence=1.0,
            distance_source="qsr",
        )
        for one, other, distance in triples
    ]
    return Relations(
        **SCENE,
        naming_frame=NamingFrame.VIEWER,
        relations=members,
        disagreements=0,
        trust_qsr=1.0,
        trust_msr=0.0,
        trust_revision=0,
    )


def beliefs(**stable: Belief) -> Beliefs:
    members = [
        ObjectBelief(name=name, stable=belief, occluded=UNDECIDED)
        for name, belief in stable.items()
    ]
    return Beliefs(
        **SCENE,
        objects=members,
        structures=[],
        derived=[],
        knowledge_revision="k",
        trust_revision=0,
    )


def of_namespace(array, namespace: str) -> list[Marker]:
    return [marker for marker in array.markers if marker.ns == namespace]


def test_old_markers_go_first_and_all_carry_the_scenes_header():
    array = markers_of(objects("a", "b"), relations(), beliefs())
    assert array.markers[0].action == Marker.DELETEALL
    assert all(marker.action == Marker.ADD for marker in array.markers[1:])
    for marker in array.markers:
        assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == (7, 8)
        assert marker.header.frame_id == "camera"
    keys = [(marker.ns, marker.id) for marker in array.markers]
    assert len(set(keys)) == len(keys)


def test_a_box_and_a_name_for_each_located_object():
    array = markers_of(objects("a", "b", hidden=("b",)), relations(), beliefs())
    [cube] = of_namespace(array, "objects")
    [name] = of_namespace(array, "names")
    assert (cube.pose.position.x, cube.scale.z) == (1.0, pytest.approx(0.3))
    assert name.text.startswith("a")


def test_arrows_join_near_pairs_alone():
    array = markers_of(
        objects("a", "b", "c", "d", hidden=("d",)),
        relations(
            ("a", "b", Distance.TOUCHING),
            ("b", "c", Distance.NOT_TOUCHING),
            ("a", "c", Distance.FAR),
            ("a", "d", Distance.TOUCHING),
            ("a", "stranger", Distance.TOUCHING),
        ),
        beliefs(),
    )
    ends = [(marker.points[0].x, marker.points[1].x) for marker in of_namespace(array, "relations")]
    assert ends == [(1.0, 2.0), (2.0, 3.0)]
    assert [marker.text for marker in of_namespace(array, "relation_names")] == ["left", "left"]


def test_each_decision_has_a_look_of_its_own():
    decisions = {
        "stable": Belief(status=DecisionStatus.STRICT, value=True),
        "unstable": Belief(status=DecisionStatus.STRICT, value=False),
        "unstable_by_default": Belief(status=DecisionStatus.BY_DEFAULT, value=False),
        "undecided": UNDECIDED,
        "inconsistent": Belief(status=DecisionStatus.INCONSISTENT),
    }
    array = markers_of(objects(*decisions), relations(), beliefs(**decisions))
    looks = {
        (cube.color.r, cube.color.g, cube.color.b, cube.color.a)
        for cube in of_namespace(array, "objects")
    }
    assert len(looks) == len(decisions)
    texts = [marker.text for marker in of_namespace(array, "names")]
    assert "unstable_by_default\nunstable by default" in texts
