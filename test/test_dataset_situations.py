"""Situations and statistics of a dataset: what its scenes are examples of."""

from ros_scenesense.geometry import Intrinsics, look_at
from ros_scenesense.messages.scenes import KnownObject, ObjectLabel
from ros_scenesense.scene import Distance, Position, Size, Surface, Truth
from ros_scenesense.simulation.dataset.record import SceneRecord
from ros_scenesense.simulation.dataset.situations import situations
from ros_scenesense.simulation.dataset.statistics import statistics
from ros_scenesense.simulation.relations import ExactRelation


def labelled(stable: Truth, occluded: Truth = Truth.FALSE, name: str = "a") -> ObjectLabel:
    return ObjectLabel(name=name, stable=stable, occluded=occluded)


def record_with(
    objects: list[KnownObject],
    labels: list[ObjectLabel],
    supports: list[tuple[str, str]],
    relations: list[tuple[str, str, str]],
) -> SceneRecord:
    return SceneRecord(
        index=0,
        arrangement="towers",
        objects=objects,
        object_labels=labels,
        structure_labels=[],
        supports=supports,
        placed=[],
        relations=[
            ExactRelation(
                object=one,
                reference=other,
                position=Position(position),
                position_ambiguous=False,
                distance=Distance.NOT_TOUCHING,
                distance_ambiguous=False,
                distance_m=0.1,
            )
            for position, one, other in relations
        ],
        hidden=[],
        background=0,
        frame_id="camera",
        camera_pose=look_at((-1.0, 0.0, 0.4), (0.0, 0.0, 0.0)),
        intrinsics=Intrinsics(64, 64, 50.0, 50.0, 32.0, 31.0),
    )


def known(name: str, size: str = "large", surface: str = "flat") -> KnownObject:
    return KnownObject(instance=1, name=name, size=Size(size), surface=Surface(surface))


def test_situations_are_those_of_the_axioms() -> None:
    record = record_with(
        [known("base", "small"), known("duck", surface="irregular"), known("top"), known("far")],
        [labelled(Truth.TRUE, name=name) for name in ("base", "duck", "top", "far")],
        [("duck", "base"), ("top", "duck")],
        [("below", "base", "duck"), ("above", "top", "duck"), ("front", "base", "far")],
    )
    base, duck, top, far = situations(record)
    assert [one.tower_height for one in (base, duck, top, far)] == [1, 2, 3, 1]
    assert [one.above for one in (base, duck, top, far)] == [False, True, True, False]
    assert [one.behind for one in (base, duck, top, far)] == [False, False, False, True]
    assert [one.small_base for one in (base, duck, top, far)] == [False, True, True, False]
    assert [one.irregular_below for one in (base, duck, top, far)] == [False, False, True, False]
    assert [one.large_on_small for one in (base, duck, top, far)] == [False, True, False, False]


def test_what_is_in_a_container_does_not_stand_on_its_surface() -> None:
    record = record_with(
        [known("mug", "small", "irregular"), known("ball")],
        [labelled(Truth.TRUE, name=name) for name in ("mug", "ball")],
        [("ball", "mug")],
        [("in", "ball", "mug")],
    )
    ball = situations(record)[1]
    assert (ball.irregular_below, ball.small_base, ball.above) == (False, False, False)
    assert ball.tower_height == 1


def test_truth_of_the_axioms_is_a_share_of_the_unambiguous() -> None:
    records = [
        record_with(
            [known("base", "small"), known("top")],
            [labelled(Truth.TRUE, name="base"), labelled(truth, name="top")],
            [("top", "base")],
            [("above", "top", "base")],
        )
        for truth in (Truth.FALSE, Truth.FALSE, Truth.FALSE, Truth.TRUE, Truth.AMBIGUOUS)
    ]
    found = statistics(records)
    assert found.figures["p_unstable_small_base"] == 0.75
    assert found.figures["p_unstable_large_on_small"] == 0.75
    assert found.figures["p_stable_not_above"] == 1.0
    assert found.figures["p_not_occluded_not_behind"] == 1.0
    assert "p_unstable_tower_above_4" not in found.figures
    assert found.figures["share_stable_ambiguous"] == 0.1
    assert found.figures["pairs_above"] == found.figures["pairs_not_touching"] == 5
    assert found.figures["pairs_in"] == 0
