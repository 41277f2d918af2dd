"""How far what objects carry hangs over, of footprints that are given."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.attention.footprint import Footprint
from ros_scenesense.attention.overhang import overhangs


def block(right, away=1.0, size=0.1, height=0.1):
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size / 2
    return Footprint(corners + np.array([right, away]), height)


def test_a_centred_block_is_within_by_half_its_width():
    found = overhangs({"a": block(0), "b": block(0)}, [("a", "b")])
    assert found == {"a": pytest.approx(-0.05)}


def test_a_block_hangs_over_where_its_centre_is_beyond_the_edge():
    for right, away, beyond in ((0.06, 1.0, 0.01), (0.0, 0.93, 0.02), (-0.04, 1.0, -0.01)):
        found = overhangs({"a": block(right, away), "b": block(0)}, [("a", "b")])
        assert found["a"] == pytest.approx(beyond)


def test_the_corners_of_a_turned_support_reach_farther_than_its_sides():
    half = 0.05 * np.sqrt(2.0)
    turned = Footprint(np.array([[half, 1], [0, 1 + half], [-half, 1], [0, 1 - half]]), 0.1)
    toward_corner, toward_side = block(0.06), block(0.05, 1.05)
    assert overhangs({"a": toward_corner, "b": turned}, [("a", "b")])["a"] < 0.0
    assert overhangs({"a": toward_side, "b": turned}, [("a", "b")])["a"] > 0.0


def test_on_an_irregular_surface_every_offset_is_an_overhang():
    found = overhangs({"a": block(0.03), "duck": block(0)}, [("a", "duck")], {"duck"})
    assert found["a"] == pytest.approx(0.03)


def test_all_that_a_support_carries_counts_by_its_volume():
    # The upper ones stand safely on each other, but both together lean over the lowest.
    boxes = {"top": block(0.08), "middle": block(0.04), "low": block(0)}
    found = overhangs(boxes, [("top", "middle"), ("middle", "low")])
    assert found == {"top": pytest.approx(0.01), "middle": pytest.approx(0.01)}
    boxes["top"] = block(0.08, height=0.01)
    assert overhangs(boxes, [("top", "middle"), ("middle", "low")])["middle"] < 0.0


def test_a_small_foot_of_what_is_carried_bounds_the_contact_too():
    boxes = {"top": block(0.03, size=0.2), "foot": block(0, size=0.04), "low": block(0, size=0.3)}
    found = overhangs(boxes, [("top", "foot"), ("foot", "low")])
    # Both weigh on the low one within its sides, but outside the foot's.
    assert found["foot"] == pytest.approx(0.03 * 0.04 / (0.04 + 0.0016) - 0.02)


def test_circles_and_strangers_do_no_harm():
    boxes = {"a": block(0.5), "b": block(0)}
    found = overhangs(boxes, [("a", "b"), ("b", "a"), ("a", "stranger"), ("a", "a")])
    assert found["a"] > 0.0
    assert overhangs({}, []) == {}


offsets = st.floats(-0.1, 0.1)


@given(offsets, offsets, st.floats(0.1, 10.0), st.floats(-np.pi, np.pi))
def test_overhang_does_not_depend_on_the_view_and_grows_with_the_scene(right, away, scale, angle):
    boxes = {"a": block(right, 1 + away), "b": block(0), "c": block(-away, 1 + right, 0.07)}
    supports = [("a", "b"), ("c", "a")]
    one = overhangs(boxes, supports)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for change in (turn * scale, np.diag([-scale, scale])):  # turned, mirrored
        seen = {
            name: Footprint(box.corners @ change.T, box.height * scale)
            for name, box in boxes.items()
        }
        assert overhangs(seen, supports) == pytest.approx(
            {name: each * scale for name, each in one.items()}, abs=1e-6
        )
