"""Size, top surface, shape and colour, on clouds of known bodies seen from above the front."""

import numpy as np
import pytest

from ros_scenesense.perception.attributes import (
    BOX,
    CYLINDER,
    OTHER,
    SPHERE,
    Attributes,
    measure_attributes,
)
from ros_scenesense.perception.colors import name_color
from ros_scenesense.scene import Size, Surface

# The camera is the origin; along right, away and up. It looks down on what stands here.
PLACE = np.array([0.05, 0.8, -0.35])


def seen(points: np.ndarray, normals: np.ndarray, noise_m: float = 0.0) -> np.ndarray:
    """Those of the points, moved to their place, whose surface faces the camera."""
    moved = points + PLACE
    facing = np.einsum("nc,nc->n", moved, normals) < 0.0
    rng = np.random.default_rng(1)
    chosen = rng.choice(np.flatnonzero(facing), 400)
    rays = moved[chosen] / np.linalg.norm(moved[chosen], axis=1, keepdims=True)
    return moved[chosen] + rays * rng.normal(0.0, noise_m, (400, 1))


def box(edges, yaw_rad=0.4, noise_m=0.0) -> np.ndarray:
    rng = np.random.default_rng(0)
    face = rng.integers(6, size=6000)
    points = rng.uniform(-0.5, 0.5, (6000, 3))
    normals = np.zeros((6000, 3))
    sign = np.where(face % 2, 1.0, -1.0)
    points[np.arange(6000), face // 2] = 0.5 * sign
    normals[np.arange(6000), face // 2] = sign
    turn = np.array(
        [[np.cos(yaw_rad), -np.sin(yaw_rad), 0], [np.sin(yaw_rad), np.cos(yaw_rad), 0], [0, 0, 1]]
    )
    return seen(points * edges @ turn.T, normals @ turn.T, noise_m)


def cylinder(diameter, height, noise_m=0.0) -> np.ndarray:
    rng = np.random.default_rng(0)
    angle = rng.uniform(0, 2 * np.pi, 6000)
    round_ = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    on_top = np.arange(6000) < 1500
    radius = np.where(on_top, np.sqrt(rng.random(6000)), 1.0) * diameter / 2
    up = np.where(on_top, height / 2, rng.uniform(-height / 2, height / 2, 6000))
    points = np.column_stack([round_ * radius[:, None], up])
    normals = np.column_stack([round_ * ~on_top[:, None], on_top])
    return seen(points, normals, noise_m)


def sphere(diameter, noise_m=0.0) -> np.ndarray:
    normals = np.random.default_rng(0).normal(size=(6000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return seen(normals * diameter / 2, normals, noise_m)


@pytest.mark.parametrize("noise_m", [0.0, 0.002])
@pytest.mark.parametrize(
    ("points", "expected"),
    [
        (lambda noise: box((0.05, 0.05, 0.05), noise_m=noise), (Size.SMALL, Surface.FLAT, BOX)),
        (lambda noise: box((0.1, 0.1, 0.1), 0.1, noise), (Size.LARGE, Surface.FLAT, BOX)),
        (lambda noise: cylinder(0.075, 0.09, noise), (Size.MEDIUM, Surface.FLAT, CYLINDER)),
        (lambda noise: cylinder(0.1, 0.12, noise), (Size.LARGE, Surface.FLAT, CYLINDER)),
        (lambda noise: sphere(0.075, noise), (Size.MEDIUM, Surface.IRREGULAR, SPHERE)),
        (lambda noise: sphere(0.1, noise), (Size.LARGE, Surface.IRREGULAR, SPHERE)),
    ],
)
def test_plain_bodies_are_told_also_with_noise(points, expected, noise_m):
    assert measure_attributes(points(noise_m), whole=True) == Attributes(*expected)


def test_two_balls_on_each_other_are_of_no_plain_shape():
    snowman = np.concatenate([sphere(0.1), sphere(0.06) + np.array([0.0, 0.0, 0.07])])
    found = measure_attributes(snowman, whole=True)
    assert (found.shape, found.surface) == (OTHER, Surface.IRREGULAR)


def test_nothing_is_told_of_what_is_hidden_or_hardly_seen():
    points = box((0.1, 0.1, 0.1))
    assert measure_attributes(points, whole=False) == Attributes()
    assert measure_attributes(points[:30], whole=True) == Attributes()
    assert measure_attributes(np.repeat(points[:1], 100, axis=0), whole=True) == Attributes()


def test_a_size_on_the_limit_between_two_classes_is_not_told():
    found = measure_attributes(cylinder(0.063, 0.063), whole=True)
    assert found.size is None
    assert found.shape == CYLINDER


@pytest.mark.parametrize(
    ("rgb", "name"),
    [
        ((204, 31, 26), "red"),
        ((26, 153, 41), "green"),
        ((31, 56, 204), "blue"),
        ((230, 199, 26), "yellow"),
        ((230, 230, 230), "white"),
        ((25, 25, 28), "black"),
        ((115, 115, 118), "grey"),
        ((240, 130, 20), "orange"),
        ((110, 70, 45), "brown"),
        ((245, 160, 185), "pink"),
        ((120, 40, 150), "purple"),
        ((30, 180, 180), "turquoise"),
    ],
)
def test_colours_have_the_names_that_people_use(rgb, name):
    assert name_color(np.tile(np.array(rgb, dtype=np.uint8), (50, 1))) == name


def test_a_textured_object_has_the_colour_of_most_of_its_pixels_in_light_and_shadow():
    rng = np.random.default_rng(0)
    light = rng.uniform(0.5, 1.0, (400, 1))
    pixels = (np.array([[204, 31, 26]]) * light).astype(np.uint8)
    pixels[:100] = 240
    assert name_color(pixels) == "red"


def test_a_motley_object_has_no_colour():
    pixels = np.repeat(np.array([[200, 30, 30], [30, 60, 200], [30, 160, 40]], np.uint8), 50, 0)
    assert name_color(pixels) is None
    assert name_color(pixels[:5]) is None
