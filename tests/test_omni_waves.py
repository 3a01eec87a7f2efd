"""The wave terrain, and looking up the ground."""

import numpy as np
import pytest

from wfbook.omni.robot import WHEEL_RADIUS, Omni, posture
from wfbook.omni.waves import LENGTH, PEAK, RUN_UP, Ground, wave_height, waves
from wfbook.terrain import ramp


@pytest.mark.parametrize("count", [3, 5])
def test_waves_are_as_high_and_as_many_as_said(count):
    terrain = waves(count)
    heights = np.array([terrain.height(x, 0.3) for x in np.linspace(-1.0, LENGTH + 1.0, 400)])
    assert heights.min() == 0.0
    assert heights.max() == pytest.approx(PEAK, rel=1e-2)
    crests = np.sum((heights[1:-1] >= heights[:-2]) & (heights[1:-1] > heights[2:]))
    assert crests == count


def test_strips_lie_on_the_wave():
    for region in waves(5).regions:
        np.testing.assert_allclose(region.vertices[:, 2], wave_height(region.vertices[:, 0]), atol=1e-12)


def test_too_little_of_a_wave_is_refused():
    with pytest.raises(ValueError, match="waves: count 0"):
        waves(0)


@pytest.mark.parametrize("terrain", [waves(4), ramp(12.0)], ids=["waves", "ramp"])
def test_looking_up_finds_what_the_terrain_says(terrain):
    ground = Ground(terrain)
    points = np.column_stack([*np.random.default_rng(0).uniform([-2, -3], [12, 3], (60, 2)).T, np.zeros(60)])
    heights, normals = ground.below(points)
    for point, height, normal in zip(points, heights, normals, strict=True):
        index = terrain.region_at(*point[:2])
        if index is None:
            assert height == 0.0 and normal[2] == 1.0
        else:
            assert height == pytest.approx(terrain.regions[index].height(*point[:2]))
            np.testing.assert_allclose(normal[2], terrain.regions[index].normal[2], atol=0.05)


def test_the_robot_rolls_down_into_a_hollow():
    robot, qpos = Omni(waves(5)), posture()
    qpos[[0, 2]] = 1.15 + 0.05, 0.53 + PEAK
    robot.reset(qpos)
    for _ in range(400):
        robot.step(robot.servo(qpos[7:], np.zeros(23)))
    heights = robot.centres[:, 2] - WHEEL_RADIUS
    assert np.all(heights > wave_height(robot.centres[:, 0]) - 0.005)
    assert RUN_UP > 0.8
