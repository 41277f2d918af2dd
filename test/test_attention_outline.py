"""What is nearer along the outline of an object: who hides it."""

import numpy as np
import pytest

from ros_scenesense.attention.outline import Outline, outline_of

NOTHING = Outline(0.0, 0.0, 0.0, 0.0)


def picture(other_depth):
    """A square, object 1, one metre away; object 2 covers its lower left; the wall is far."""
    depth = np.full((120, 160), 2.0, np.float32)
    instances = np.zeros((120, 160), np.uint16)
    depth[40:80, 60:100], instances[40:80, 60:100] = 1.0, 1
    depth[60:90, 40:80], instances[60:90, 40:80] = other_depth, 2
    return depth, instances


def test_what_hides_an_object_is_nearer_along_a_part_of_its_outline():
    depth, instances = picture(0.8)
    hidden = outline_of(depth, instances, 1, [])
    assert hidden.upper_other == hidden.upper_related == hidden.lower_related == 0.0
    assert 0.15 < hidden.lower_other < 0.4
    # What hides has only farther things around it.
    assert outline_of(depth, instances, 2, []) == NOTHING


def test_related_objects_are_told_from_others():
    depth, instances = picture(0.8)
    other, related = (outline_of(depth, instances, 1, each) for each in ([], [2]))
    assert related == Outline(0.0, 0.0, other.lower_other, 0.0)


def test_above_is_told_from_below():
    depth, instances = (np.flipud(each) for each in picture(0.8))
    assert outline_of(depth, instances, 1, []).upper_other > 0.15


def test_touching_at_the_same_depth_and_noise_hide_nothing():
    rng = np.random.default_rng(0)
    depth, instances = picture(1.0)
    noisy = depth + rng.normal(0.0, 0.003, depth.shape).astype(np.float32)
    assert outline_of(noisy, instances, 1, []) == NOTHING


@pytest.mark.parametrize("hole", [0.0, np.nan])
def test_without_readings_nothing_is_known(hole):
    depth, instances = picture(0.8)
    assert outline_of(np.full_like(depth, hole), instances, 1, []) == NOTHING
    depth[instances == 2] = hole
    assert outline_of(depth, instances, 1, []) == NOTHING
    assert outline_of(depth, instances, 7, []) == NOTHING


def test_an_object_that_fills_the_image_or_touches_its_edge():
    depth = np.ones((12, 16), np.float32)
    assert outline_of(depth, np.ones((12, 16), np.uint16), 1, []) == NOTHING
    instances = np.zeros((12, 16), np.uint16)
    instances[:, 8:] = 1
    depth[:, :8] = 0.5
    found = outline_of(depth, instances, 1, [])
    assert found.upper_other + found.lower_other == pytest.approx(1.0)
