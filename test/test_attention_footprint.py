"""Footprints of cylinders and blocks as a depth camera shows them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.attention.footprint import box_footprint, footprint_of
from ros_scenesense.attention.regions import rectangles
from ros_scenesense.attention.scan import viewer_axes
from ros_scenesense.geometry import Box, Intrinsics, Pose, quaternion_of

CAMERA = Intrinsics(width=320, height=240, fx=330.0, fy=330.0, cx=159.5, cy=119.5)
PITCH = math.radians(22.0)
AXES = viewer_axes(np.array([0.0, -math.cos(PITCH), -math.sin(PITCH)]))
LOW = -0.45
"""Height of the table, seen from the camera."""


SIGHTS = CAMERA.rays() @ AXES.T


def image(*bodies):
    """Depth (H, W) of bodies: of each the depths where lines of sight enter and leave it."""
    depth = np.full(SIGHTS.shape[:2], np.inf)
    for enter, leave in bodies:
        depth = np.where(enter < leave, np.minimum(depth, enter), depth)
    return np.where(np.isfinite(depth), depth, 0.0).astype(np.float32)


def slab(along, middle, width):
    """Depths where lines of sight enter and leave what lies between two planes."""
    with np.errstate(divide="ignore"):
        ends = np.array([middle - width / 2, middle + width / 2])[:, None, None] / along
    return ends.min(axis=0), ends.max(axis=0)


def both(*parts):
    return np.max([one[0] for one in parts], axis=0), np.min([one[1] for one in parts], axis=0)


def cylinder(right, away, radius, height):
    square = SIGHTS[..., 0] ** 2 + SIGHTS[..., 1] ** 2
    along = SIGHTS[..., 0] * right + SIGHTS[..., 1] * away
    inside = along**2 - square * (right**2 + away**2 - radius**2)
    root = np.sqrt(np.maximum(inside, 0.0))
    near = np.where(inside > 0.0, (along - root) / square, np.inf)
    far = np.where(inside > 0.0, (along + root) / square, -np.inf)
    return both((near, far), slab(SIGHTS[..., 2], LOW + height / 2, height))


def block(right, away, width, depth, degrees, height):
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    along, across = np.array([cosine, sine]), np.array([-sine, cosine])
    sights, middle = SIGHTS[..., :2], np.array([right, away])
    return both(
        slab(sights @ along, middle @ along, width),
        slab(sights @ across, middle @ across, depth),
        slab(SIGHTS[..., 2], LOW + height / 2, height),
    )


def found(depth, covered=True):
    mask = depth > 0
    place = rectangles(mask.astype(np.uint16))[1]
    part = np.s_[place.top : place.bottom, place.left : place.right]
    return footprint_of(depth[part], CAMERA, mask[part], place, AXES, covered)


@pytest.mark.parametrize(("right", "away"), [(0.0, 0.9), (-0.15, 1.0), (0.2, 0.85)])
def test_a_cylinder_stands_behind_its_front(right, away):
    one = found(image(cylinder(right, away, 0.04, 0.1)))
    assert one.middle == pytest.approx((right, away), abs=0.002)
    assert one.area == pytest.approx(math.pi * 0.04**2, rel=0.08)
    assert one.height == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize("degrees", [2, 12, 30, 45, 61, 80])
def test_a_cube_is_found_however_it_is_turned(degrees):
    one = found(image(block(0.05, 0.95, 0.08, 0.08, degrees, 0.08)))
    assert one.middle == pytest.approx((0.05, 0.95), abs=0.002)
    assert len(one.corners) == 4
    assert one.area == pytest.approx(0.08**2, rel=0.06)


def test_of_a_block_seen_from_an_edge_both_sides_are_measured():
    one = found(image(block(0.0, 0.95, 0.06, 0.12, 40, 0.1)))
    assert one.middle == pytest.approx((0.0, 0.95), abs=0.003)
    assert one.area == pytest.approx(0.06 * 0.12, rel=0.08)


def test_of_a_block_seen_from_the_front_the_top_tells_how_deep_it_is():
    depth = image(block(0.0, 0.95, 0.14, 0.06, 0, 0.1))
    assert found(depth, covered=False).middle == pytest.approx((0.0, 0.95), abs=0.006)
    # Without it, as deep as wide.
    assert found(depth, covered=True).middle == pytest.approx((0.0, 0.99), abs=0.006)


def test_noise_is_averaged_and_what_shines_through_at_edges_is_not_believed():
    depth = image(cylinder(0.1, 0.9, 0.04, 0.1))
    rng = np.random.default_rng(0)
    mask = depth > 0
    noisy = np.where(mask, depth + rng.normal(0.0, 0.002, depth.shape), 0.0)
    columns = np.flatnonzero(mask.any(axis=0))
    noisy[:, columns[[0, -1]]] += 0.3 * mask[:, columns[[0, -1]]]
    noisy[mask & (rng.random(depth.shape) < 0.1)] = np.nan
    place = rectangles(mask.astype(np.uint16))[1]
    part = np.s_[place.top : place.bottom, place.left : place.right]
    one = footprint_of(noisy[part].astype(np.float32), CAMERA, mask[part], place, AXES, True)
    assert one.middle == pytest.approx((0.1, 0.9), abs=0.002)


def test_a_handle_is_no_part_of_the_body():
    body = cylinder(0.0, 0.9, 0.04, 0.1)
    handle = block(0.04, 0.9, 0.06, 0.01, 0, 0.02)
    mug = image(body, handle)
    assert (mug > 0).sum() > (image(body) > 0).sum() + 20
    assert found(mug).middle == pytest.approx((0.0, 0.9), abs=0.002)


def test_too_little_or_unread_is_none():
    depth = image(cylinder(0.0, 0.9, 0.04, 0.1))
    mask = depth > 0
    place = rectangles(mask.astype(np.uint16))[1]
    part = np.s_[place.top : place.bottom, place.left : place.right]
    for unread in (0.0, np.nan):
        nothing = np.full_like(depth[part], unread)
        assert footprint_of(nothing, CAMERA, mask[part], place, AXES, True) is None
    few = np.zeros_like(mask[part])
    few[20, 10:20] = True
    assert footprint_of(depth[part], CAMERA, few, place, AXES, True) is None


@settings(max_examples=15)
@given(st.integers(1, 89), st.floats(-0.15, 0.15))
def test_a_mirrored_image_has_the_mirrored_footprint(degrees, right):
    depth = image(block(right, 0.95, 0.07, 0.07, degrees, 0.08))
    one, other = found(depth), found(np.ascontiguousarray(depth[:, ::-1]))
    assert other.middle == pytest.approx(one.middle * (-1, 1), abs=0.002)
    assert other.area == pytest.approx(one.area, rel=0.05)


@settings(max_examples=15)
@given(st.integers(60, 100), st.integers(0, 5), st.booleans(), st.integers(0, 2**32 - 1))
def test_whatever_is_in_the_image_nothing_is_raised(readings, size, covered, seed):
    rng = np.random.default_rng(seed)
    depth = rng.choice([0.0, np.nan, 0.4, 0.9, 3.0], (24, 32)).astype(np.float32)
    depth[: readings // 5] += rng.normal(0.0, 0.01, (readings // 5, 32)).astype(np.float32)[:24]
    mask = rng.random((24, 32)) < 10.0**-size * 5
    if not mask.any():
        return
    place = rectangles(mask.astype(np.uint16))[1]
    part = np.s_[place.top : place.bottom, place.left : place.right]
    one = footprint_of(depth[part], CAMERA, mask[part], place, AXES, covered)
    assert one is None or np.isfinite([*one.corners.flat, one.height]).all()


def test_a_box_of_which_only_the_front_is_seen_is_as_deep_as_it_is_wide():
    x, y, z = AXES.T @ (0.1, 0.9, -0.4)
    one = box_footprint(Box(Pose((x, y, z), quaternion_of(AXES.T)), (0.1, 0.02, 0.06)), AXES)
    assert one.middle == pytest.approx((0.1, 0.89 + 0.05))
    assert one.area == pytest.approx(0.01)
    assert one.height == pytest.approx(0.06)


def test_viewer_axes_are_level_and_right_handed_also_straight_down():
    for up in (AXES[2], np.array([0.0, 0.0, -1.0])):
        axes = viewer_axes(up)
        assert axes @ axes.T == pytest.approx(np.eye(3))
        assert np.linalg.det(axes) == pytest.approx(1.0)
        assert axes[0] == pytest.approx((1.0, 0.0, 0.0))
