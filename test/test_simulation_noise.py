"""The noise of depth cameras: what the settings say is what the readings show, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Intrinsics
from ros_scenesense.simulation.noise import KINECT, NONE, PRESETS, NoiseSettings, noisy

CAMERA = Intrinsics(width=200, height=150, fx=200.0, fy=200.0, cx=100.0, cy=75.0)
KINECT_SETTINGS = PRESETS[KINECT]
# The axial part alone, where nothing else moves or hides a reading.
AXIAL = NoiseSettings(axial_m=0.0012, axial_growth=0.0019)


def wall(distance_m: float) -> np.ndarray:
    return np.full((CAMERA.height, CAMERA.width), distance_m, dtype=np.float32)


def block_before_a_wall() -> np.ndarray:
    depth = wall(1.5)
    depth[50:100, 80:120] = 0.8
    return depth


def read(depth: np.ndarray, settings: NoiseSettings, seed: int = 0) -> np.ndarray:
    return noisy(depth, CAMERA, settings, np.random.default_rng(seed))


def test_without_noise_the_readings_are_the_truth_and_what_is_nothing_is_zero():
    depth = block_before_a_wall()
    depth[0, :3] = [np.nan, np.inf, -1.0]
    got = read(depth, PRESETS[NONE])
    assert got[0, :3].tolist() == [0.0, 0.0, 0.0]
    assert np.array_equal(got[1:], depth[1:])


@pytest.mark.parametrize("distance_m", [0.6, 1.0, 2.0, 3.0])
def test_axial_noise_grows_with_the_square_of_the_distance(distance_m):
    error = read(wall(distance_m), AXIAL) - distance_m
    expected = 0.0012 + 0.0019 * (distance_m - 0.4) ** 2
    assert np.std(error) == pytest.approx(expected, rel=0.03)
    assert abs(np.mean(error)) < expected / 20.0


def test_readings_come_in_steps_of_disparity_that_grow_with_the_square_of_the_distance():
    settings = NoiseSettings(baseline_m=0.075, disparity_steps=8.0 * 585.0)
    ramp = np.linspace(1.0, 3.0, CAMERA.width * CAMERA.height, dtype=np.float32)
    got = np.unique(read(np.sort(ramp).reshape(CAMERA.height, -1), settings))
    got = got[got > 0.0]
    steps = np.diff(got)
    scale = 8.0 * 585.0 * 0.075
    assert np.allclose(scale / got, np.round(scale / got), atol=1e-3)
    assert np.allclose(steps, got[:-1] * got[1:] / scale, rtol=0.02)


def test_lateral_noise_frays_edges_and_leaves_even_surfaces_alone():
    settings = NoiseSettings(lateral=0.8 / 585.0 * 3.0)
    depth = block_before_a_wall()
    changed = read(depth, settings) != depth
    assert changed[:, 78:83].any()
    assert not changed[60:90, 90:110].any()
    assert set(np.unique(read(depth, settings))) == {np.float32(0.8), np.float32(1.5)}


def test_the_projector_to_the_right_leaves_a_shadow_of_the_right_width_on_the_left():
    got = read(block_before_a_wall(), NoiseSettings(baseline_m=0.075))
    width = CAMERA.fx * 0.075 * (1.0 / 0.8 - 1.0 / 1.5)
    row = got[75] == 0.0
    assert np.count_nonzero(row) == pytest.approx(width, abs=1.0)
    assert row[79]
    assert not row[120]


def test_mixed_pixels_lie_between_the_two_surfaces_of_an_edge():
    depth = block_before_a_wall()
    got = read(depth, NoiseSettings(mixed_share=0.5))
    between = (got > 0.801) & (got < 1.499)
    assert between.any()
    rows, columns = np.nonzero(between)
    assert rows.min() >= 49
    assert rows.max() <= 100
    inside = (rows >= 51) & (rows <= 98) & (columns >= 81) & (columns <= 118)
    assert not inside.any()


def test_surfaces_seen_at_a_grazing_angle_read_less_and_less():
    table = np.zeros((CAMERA.height, CAMERA.width), dtype=np.float32)
    below = np.arange(CAMERA.height)[90:, None] - CAMERA.cy
    table[90:] = 0.3 / (below / CAMERA.fy)
    settings = NoiseSettings(grazing_from_rad=np.deg2rad(70.0), grazing_to_rad=np.deg2rad(88.0))
    lost = np.mean(read(table, settings)[90:] == 0.0, axis=1)
    # A table 0.3 m below: the angle is that of the pixel's ray above the table.
    assert lost[0] > 0.6
    assert lost[-1] < 0.06
    assert np.corrcoef(lost, np.arange(len(lost)))[0, 1] < -0.8


def test_what_is_out_of_range_reads_nothing():
    settings = NoiseSettings(nearest_m=0.4, farthest_m=5.0)
    assert not read(wall(0.39), settings).any()
    assert not read(wall(5.01), settings).any()
    assert read(wall(4.9), settings).all()


def test_the_kinect_loses_readings_at_edges_and_keeps_most_of_the_rest():
    depth = block_before_a_wall()
    got = read(depth, KINECT_SETTINGS)
    lost = got == 0.0
    assert np.mean(lost) < 0.08
    assert np.mean(lost[:, 121:]) < 0.01
    assert np.mean(lost[52:98, 79:81]) > 0.25
    kept = ~lost
    assert np.median(np.abs(got - depth)[kept]) < 0.005


def test_the_same_seed_gives_the_same_readings_and_another_one_others():
    depth = block_before_a_wall()
    assert np.array_equal(read(depth, KINECT_SETTINGS, 1), read(depth, KINECT_SETTINGS, 1))
    assert not np.array_equal(read(depth, KINECT_SETTINGS, 1), read(depth, KINECT_SETTINGS, 2))


def test_an_image_of_nothing_stays_one():
    assert not read(wall(0.0), KINECT_SETTINGS).any()


def test_a_setting_changes_what_it_names():
    assert replace(PRESETS[NONE], axial_m=0.001) != PRESETS[NONE]
    assert np.std(read(wall(1.0), NoiseSettings(axial_m=0.001))) == pytest.approx(0.001, rel=0.05)


def test_an_image_of_another_size_is_refused():
    with pytest.raises(SimulationError, match=r"\(10, 10\).*\(150, 200\)"):
        noisy(np.ones((10, 10), np.float32), CAMERA, KINECT_SETTINGS, np.random.default_rng(0))
