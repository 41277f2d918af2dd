"""The vocabulary, structures and frames."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Intrinsics
from ros_scenesense.scene import Frame, Position, find_structures, structure_truth

# Among the supports are cycles, objects on themselves, and objects that the scene does not have.
NAMES = st.integers(0, 6).flatmap(lambda count: st.permutations("abcdef"[:count]))
SUPPORTS = st.lists(st.tuples(*[st.sampled_from("abcdefx")] * 2), max_size=8)


def test_every_position_but_in_has_a_converse_that_leads_back():
    for position in Position:
        if position is Position.IN:
            assert position.converse is None
        else:
            assert position.converse not in (None, position)
            assert position.converse.converse is position


@pytest.mark.parametrize(
    ("one", "other"), [("above", "below"), ("front", "behind"), ("left", "right")]
)
def test_the_converses(one, other):
    assert Position(one).converse is Position(other)


def connected(names, supports):
    """All pairs (a, b) with a path from a to b, by following supports until nothing is new."""
    pairs = {(name, name) for name in names}
    edges = {pair for pair in supports if set(pair) <= set(names)}
    edges |= {(lower, upper) for upper, lower in edges}
    while True:
        longer = {(a, d) for a, b in pairs for c, d in edges if b == c} - pairs
        if not longer:
            return pairs
        pairs |= longer


@given(NAMES, SUPPORTS)
def test_structures_are_the_connected_components(names, supports):
    structures = find_structures(names, supports)
    assert structures == sorted(structures)
    assert sorted(itertools.chain(*structures)) == sorted(names)
    assert all(list(members) == sorted(members) for members in structures)
    together = {pair for members in structures for pair in itertools.product(members, repeat=2)}
    assert together == connected(names, supports)


@given(NAMES, SUPPORTS, st.randoms(use_true_random=False))
def test_structures_do_not_depend_on_the_order(names, supports, random):
    expected = find_structures(names, supports)
    random.shuffle(names)
    random.shuffle(supports)
    assert find_structures(names, supports) == expected


def test_structures_of_a_stack_an_arch_and_a_single_object():
    supports = [("lintel", "left"), ("lintel", "right"), ("can", "cube")]
    names = ["duck", "can", "cube", "lintel", "left", "right"]
    assert find_structures(names, supports) == [
        ("can", "cube"),
        ("duck",),
        ("left", "lintel", "right"),
    ]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([True, True], True),
        ([True, False], False),
        ([None, False], False),
        ([True, None], None),
        ([None], None),
        ([False], False),
        ([], None),
    ],
)
def test_truth_of_a_structure(values, expected):
    stable = {str(index): value for index, value in enumerate(values)}
    assert structure_truth(stable, stable) is expected
    known = {name: value for name, value in stable.items() if value is not None}
    assert structure_truth(stable, known) is expected


def frame(**fields):
    return Frame(
        **{
            "stamp_ns": 1,
            "frame_id": "camera",
            "color": np.zeros((3, 4, 3), np.uint8),
            "depth": np.zeros((3, 4), np.float32),
            "intrinsics": Intrinsics(width=4, height=3, fx=5.0, fy=5.0, cx=2.0, cy=1.0),
            "instances": np.zeros((3, 4), np.uint16),
            **fields,
        }
    )


def test_a_frame_may_lack_instances_and_pose():
    assert frame(instances=None).camera_pose is None


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"color": np.zeros((4, 3, 3), np.uint8)}, r"color image is uint8 \(4, 3, 3\)"),
        ({"color": np.zeros((3, 4), np.uint8)}, r"asks for uint8 \(3, 4, 3\)"),
        ({"color": np.zeros((3, 4, 3), np.float32)}, "color image is float32"),
        ({"depth": np.zeros((3, 4), np.uint16)}, "depth image is uint16"),
        ({"depth": np.zeros((3, 4, 1), np.float32)}, "depth image"),
        ({"depth": np.zeros((0, 0), np.float32)}, "depth image"),
        ({"instances": np.zeros((3, 4), np.int32)}, "instances image is int32"),
        ({"instances": np.zeros((3, 5), np.uint16)}, "instances image"),
    ],
)
def test_images_that_do_not_fit_are_refused(fields, words):
    with pytest.raises(FrameError, match=words):
        frame(**fields)


@pytest.mark.parametrize(
    "fault",
    [
        {"width": 0},
        {"height": 0},
        {"fx": 0.0},
        {"fy": -1.0},
        {"fx": float("inf")},
        {"cx": float("nan")},
    ],
)
def test_a_camera_that_is_not_calibrated_is_refused(fault):
    values = {"width": 4, "height": 3, "fx": 5.0, "fy": 5.0, "cx": 2.0, "cy": 1.0} | fault
    with pytest.raises(FrameError, match="calibrated"):
        frame(intrinsics=Intrinsics(**values))


def test_a_frame_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        frame().stamp_ns = 2
