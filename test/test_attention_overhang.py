"""The overhang of stacked boxes, as seen by a camera that looks straight ahead."""

import numpy as np
import pytest

from ros_scenesense.attention.overhang import LARGEST, Overhang, overhangs
from ros_scenesense.geometry import Box, Pose, quaternion_of

# Optical frame z forward, x right, y down: right, away, up of a level camera.
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def box(right, up, size=0.1, away=1.0, depth=None):
    x, y, z = AXES.T @ (right, away, up)
    return Box(Pose((x, y, z), quaternion_of(AXES.T)), (size, depth or size, size))


def test_nothing_hangs_over_where_boxes_are_centred():
    found = overhangs({"a": box(0, 0.1), "b": box(0, 0)}, [("a", "b")])
    assert found == {"a": Overhang(pytest.approx(0), pytest.approx(0))}


def test_the_share_is_of_half_the_width_of_the_contact():
    # The upper box hangs over by 3 of 10 cm: it touches 7 cm, whose middle is 1.5 cm from its own.
    found = overhangs({"a": box(0.03, 0.1), "b": box(0, 0)}, [("a", "b")])
    assert found["a"].lateral == pytest.approx(0.015 / 0.035)
    found = overhangs({"a": box(0, 0.1, away=1.06), "b": box(0, 0)}, [("a", "b")])
    assert found["a"] == Overhang(pytest.approx(0), pytest.approx(0.03 / 0.02))


def test_a_small_box_on_a_large_one_is_safe_wherever_it_stands():
    found = overhangs({"a": box(0.08, 0.15), "b": box(0, 0, size=0.2)}, [("a", "b")])
    assert found["a"].lateral == pytest.approx(0.015 / 0.035)


def test_on_an_irregular_surface_every_offset_is_an_overhang():
    boxes = {"a": box(0.03, 0.1), "duck": box(0, 0)}
    assert overhangs(boxes, [("a", "duck")], {"duck"})["a"].lateral == LARGEST


def test_all_that_a_support_carries_counts_by_its_volume():
    # The upper one stands safely on the middle one, but both together lean over the lowest.
    boxes = {"top": box(0.08, 0.2), "middle": box(0.04, 0.1), "low": box(0, 0)}
    found = overhangs(boxes, [("top", "middle"), ("middle", "low")])
    # Both touch the lowest from -1 to 5 cm; their common centre of mass is at 6 cm.
    assert found["middle"].lateral == pytest.approx(0.04 / 0.03)
    assert found["top"].lateral == pytest.approx(0.04 / 0.03)
    assert "low" not in found


def test_of_a_thin_front_the_rest_is_thought_behind_it():
    seen = {"a": box(0, 0.1, away=0.96, depth=0.02), "b": box(0, 0, away=1.0)}
    assert overhangs(seen, [("a", "b")])["a"].away == pytest.approx(0)


def test_circles_and_strangers_do_no_harm():
    boxes = {"a": box(0.5, 0.1), "b": box(0, 0)}
    found = overhangs(boxes, [("a", "b"), ("b", "a"), ("a", "stranger"), ("a", "a")])
    assert found["a"].lateral == LARGEST
    assert overhangs({}, []) == {}
