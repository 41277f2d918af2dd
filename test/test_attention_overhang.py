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


def test_the_share_is_of_the_supports_half_width():
    found = overhangs({"a": box(0.03, 0.1), "b": box(0, 0)}, [("a", "b")])
    assert found["a"].lateral == pytest.approx(0.6)
    found = overhangs({"a": box(0, 0.1, away=1.06), "b": box(0, 0)}, [("a", "b")])
    assert found["a"] == Overhang(pytest.approx(0), pytest.approx(1.2))


def test_all_that_a_support_carries_counts_by_its_volume():
    # The upper one stands safely on the middle one, but both together lean over the lowest.
    boxes = {"top": box(0.08, 0.2), "middle": box(0.04, 0.1), "low": box(0, 0)}
    found = overhangs(boxes, [("top", "middle"), ("middle", "low")])
    assert found["middle"].lateral == pytest.approx(0.06 / 0.05)
    assert found["top"].lateral == pytest.approx(0.06 / 0.05)
    assert "low" not in found


def test_of_a_thin_front_the_rest_is_thought_behind_it():
    seen = {"a": box(0, 0.1, away=0.96, depth=0.02), "b": box(0, 0, away=1.0)}
    assert overhangs(seen, [("a", "b")])["a"].away == pytest.approx(0)


def test_circles_and_strangers_do_no_harm():
    boxes = {"a": box(0.5, 0.1), "b": box(0, 0)}
    found = overhangs(boxes, [("a", "b"), ("b", "a"), ("a", "stranger"), ("a", "a")])
    assert found["a"].lateral == LARGEST
    assert overhangs({}, []) == {}
