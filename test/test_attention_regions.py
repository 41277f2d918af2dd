"""Regions of interest: what belongs together, what is looked at, and what is left out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.attention.inputs import color_image, query_image
from ros_scenesense.attention.regions import Rectangle, crop, rectangles, regions
from ros_scenesense.attention.relevance import Relevance
from ros_scenesense.errors import NetworkError
from ros_scenesense.geometry import Intrinsics
from ros_scenesense.messages.attention import Roi
from ros_scenesense.messages.grounding import Relation
from ros_scenesense.scene import Distance, Frame, Position, Task

ABOVE = Relevance(Task.STABILITY, ("s1",), frozenset({frozenset({"above"})}))
ON = Relevance(Task.STABILITY, ("tall_tower",), frozenset({frozenset({"above", "touching"})}))
BEHIND = Relevance(Task.OCCLUSION, ("o1",), frozenset({frozenset({"behind"})}))
SIZE = (100, 80)


def relation(one, position, other, distance="not_touching"):
    return Relation(
        object=one,
        reference=other,
        position=Position(position),
        position_confidence=1.0,
        position_source="qsr",
        distance=Distance(distance),
        distance_confidence=1.0,
        distance_source="qsr",
    )


# The paper's figure: duck on red can on white cube, a mug before them, a pitcher to the side.
BOXES = {
    "duck": Rectangle(40, 10, 52, 22),
    "red_can": Rectangle(40, 22, 52, 40),
    "white_cube": Rectangle(38, 40, 54, 58),
    "mug": Rectangle(30, 48, 42, 62),
    "pitcher": Rectangle(75, 20, 95, 55),
}
RELATIONS = [
    relation("duck", "above", "red_can", "touching"),
    relation("duck", "above", "white_cube"),
    relation("red_can", "above", "white_cube", "touching"),
    relation("mug", "front", "white_cube"),
    relation("mug", "front", "red_can"),
    relation("duck", "right", "mug"),
    relation("pitcher", "right", "duck"),
    relation("pitcher", "right", "red_can"),
    relation("pitcher", "right", "white_cube"),
    relation("mug", "left", "pitcher"),
]


def test_stability_of_the_stack_is_looked_for_in_the_stack():
    (roi,) = regions(ABOVE, RELATIONS, {"duck"}, BOXES, SIZE)
    assert roi.objects == ["duck", "red_can", "white_cube"]
    assert roi.targets == ["duck"]
    assert (roi.left, roi.top, roi.width, roi.height) == (36, 8, 20, 52)
    assert (roi.axioms, roi.relations) == (["s1"], ["above"])


def test_occlusion_of_the_cube_is_looked_for_among_what_is_behind_and_before():
    (roi,) = regions(BEHIND, RELATIONS, {"white_cube"}, BOXES, SIZE)
    assert roi.objects == ["mug", "red_can", "white_cube"]


def test_all_relations_of_a_pattern_must_hold_of_a_pair():
    relations = [relation("a", "above", "b"), relation("c", "below", "b", "touching")]
    boxes = {name: Rectangle(10 * i, 0, 10 * i + 9, 9) for i, name in enumerate("abc")}
    (alone,) = regions(ON, relations, {"a"}, boxes, SIZE)
    assert alone.objects == ["a"]
    (stack,) = regions(ON, relations, {"b"}, boxes, SIZE)
    assert stack.objects == ["b", "c"]


def test_who_is_not_in_the_image_is_not_looked_at():
    assert regions(ABOVE, RELATIONS, {"hidden"}, BOXES, SIZE) == []
    boxes = {name: box for name, box in BOXES.items() if name != "red_can"}
    (roi,) = regions(ABOVE, RELATIONS, {"duck"}, boxes, SIZE)
    assert roi.objects == ["duck", "white_cube"]


def test_nothing_in_question_nothing_to_look_at():
    assert regions(ABOVE, RELATIONS, set(), BOXES, SIZE) == []


names = st.sampled_from([f"o{number}" for number in range(9)])


@given(
    pairs=st.lists(
        st.tuples(names, st.sampled_from(["above", "below", "left", "in"]), names).filter(
            lambda each: each[0] != each[2]
        )
    ),
    targets=st.sets(names),
    corners=st.dictionaries(names, st.tuples(st.integers(0, 89), st.integers(0, 69))),
    most=st.integers(1, 6),
)
def test_every_visible_target_is_in_one_region_that_holds_its_objects(
    pairs, targets, corners, most
):
    boxes = {name: Rectangle(x, y, x + 10, y + 10) for name, (x, y) in corners.items()}
    relations = [relation(one, position, other) for one, position, other in pairs]
    found = regions(ABOVE, relations, targets, boxes, SIZE, most)
    assert sorted(name for roi in found for name in roi.targets) == sorted(targets & boxes.keys())
    for roi in found:
        assert 1 <= len(roi.objects) <= most
        assert set(roi.targets) <= set(roi.objects)
        assert roi.left + roi.width <= SIZE[0]
        assert roi.top + roi.height <= SIZE[1]
        for name in roi.objects:
            assert roi.left <= boxes[name].left
            assert boxes[name].right <= roi.left + roi.width


def test_rectangles_are_those_of_the_pixels():
    instances = np.zeros((8, 10), np.uint16)
    instances[2:4, 3:7] = 7
    instances[5, 1] = 300
    assert rectangles(instances) == {7: Rectangle(3, 2, 7, 4), 300: Rectangle(1, 5, 2, 6)}


# --- What networks are shown.


def roi_of(left, top, width, height):
    return Roi(
        task=Task.STABILITY,
        left=left,
        top=top,
        width=width,
        height=height,
        objects=["a"],
        targets=["a"],
        axioms=[],
        relations=[],
    )


@pytest.fixture
def frame():
    instances = np.zeros((20, 30), np.uint16)
    instances[5:15, 5:10] = 1
    instances[5:15, 10:20] = 2
    depth = np.full((20, 30), 2.0, np.float32)
    depth[instances == 1] = 1.0
    depth[instances == 2] = 1.15
    depth[0] = np.nan
    color = np.zeros((20, 30, 3), np.uint8)
    color[instances == 1] = (255, 0, 0)
    return Frame(0, "camera", color, depth, Intrinsics(30, 20, 30, 30, 15, 10), instances)


def test_a_query_shows_the_target_its_relatives_and_the_depth_between_them(frame):
    image = query_image(frame, frame.instances, roi_of(5, 5, 15, 10), 1, {2}, side=15)
    assert image.shape == (6, 15, 15)
    assert image[:, 7, 2] == pytest.approx([1, 0, 0, 0, 1, 0])  # the target
    assert image[:, 7, 10] == pytest.approx([0, 0, 0, 0.5, 0, 1], abs=1e-5)  # 15 cm behind it
    assert not image[:, :2].any()  # outside: the region is wider than high
    assert not image[:, 13:].any()


def test_holes_in_the_depth_are_as_far_as_the_target(frame):
    image = query_image(frame, frame.instances, roi_of(0, 0, 30, 20), 1, set(), side=30)
    assert np.isfinite(image).all()
    assert not image[3, 5].any()  # the row of holes
    frame.depth[frame.instances == 1] = 0.0
    blind = query_image(frame, frame.instances, roi_of(0, 0, 30, 20), 1, set(), side=30)
    assert not blind[3].any()


@pytest.mark.parametrize("place", [(25, 0, 6, 5), (0, 18, 5, 5), (3, 3, 0, 4)])
def test_a_region_outside_the_image_is_refused(frame, place):
    with pytest.raises(NetworkError, match="not inside the image of 30x20"):
        query_image(frame, frame.instances, roi_of(*place), 1, set(), side=8)
    with pytest.raises(NetworkError, match="not inside"):
        color_image(frame.color, 8, roi_of(*place))
    with pytest.raises(ValueError, match="not inside"):
        crop(frame.depth, roi_of(*place))


def test_a_region_without_its_target_is_refused(frame):
    with pytest.raises(NetworkError, match="no pixel of instance 3"):
        query_image(frame, frame.instances, roi_of(0, 0, 30, 20), 3, set(), side=8)


def test_a_whole_image_keeps_its_proportions(frame):
    image = color_image(frame.color, 30)
    assert image.shape == (3, 30, 30)
    assert image[:, 15, 7] == pytest.approx([1, 0, 0])
    assert not image[:, :5].any()
