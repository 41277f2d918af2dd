"""The table plane, found among whatever else stands there."""

import numpy as np
import pytest

from ros_scenesense.perception.plane import find_plane


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def table(normal: np.ndarray, height_m: float, count: int, noise_m: float = 0.0) -> np.ndarray:
    """Points of a plane below a camera at the origin."""
    across = np.linalg.svd(normal[None])[2][1:]
    spread = rng(1).uniform(-0.5, 0.5, (count, 2)) @ across
    return spread - normal * (height_m + noise_m * rng(2).standard_normal((count, 1)))


@pytest.mark.parametrize("pitch_deg", [5.0, 30.0, 60.0, 90.0])
def test_finds_a_noisy_table_among_as_much_clutter(pitch_deg):
    pitch = np.radians(pitch_deg)
    normal = np.array([0.0, -np.cos(pitch), -np.sin(pitch)])
    clutter = rng(3).uniform(-1.0, 1.0, (1000, 3)) + np.array([0.0, 0.0, 1.0])
    plane = find_plane(np.concatenate([table(normal, 0.6, 1000, 0.003), clutter]), rng())
    assert plane.normal @ normal > np.cos(np.radians(0.5))
    assert plane.height_m == pytest.approx(0.6, abs=0.002)
    assert plane.share == pytest.approx(0.5, abs=0.05)


def test_same_seed_same_plane():
    points = np.concatenate(
        [table(np.array([0.0, -1.0, 0.0]), 0.5, 300, 0.004), rng(4).uniform(-1, 1, (300, 3))]
    )
    first, second = find_plane(points, rng(7)), find_plane(points, rng(7))
    assert first.normal.tolist() == second.normal.tolist()


@pytest.mark.parametrize(
    "points",
    [
        np.empty((0, 3)),
        np.ones((49, 3)),
        np.ones((500, 3)),  # one place, no plane
        np.outer(np.linspace(1.0, 2.0, 500), [1.0, 2.0, 3.0]),  # a line
        rng(5).uniform(-1.0, 1.0, (2000, 3)),  # a cloud
        np.full((500, 3), 3e38),
    ],
    ids=["none", "too few", "one place", "line", "cloud", "absurd"],
)
def test_finds_no_plane_where_there_is_none(points):
    assert find_plane(points, rng()) is None
