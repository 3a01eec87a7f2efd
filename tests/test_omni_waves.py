"""The wave terrain, and looking up the ground."""

import numpy as np
import pytest

from wfbook.omni.robot import WHEEL_RADIUS, Omni, posture
from wfbook.omni.waves import LENGTH, PEAK, RUN_UP, Ground, wave_height, waves
from wfbook.terrain import Region, Terrain, ramp

FRICTION = ("mu_foot", "mu_wheel", "mu_wheel_lateral", "rolling_resistance")


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


def test_over_no_region_the_ground_is_level():
    heights, normals = Ground(waves(3)).below(np.array([[50.0, 0.0], [0.3, 2.5], [-1.7, 0.0], [np.nan, 0.0]]))
    assert np.all(heights == 0.0) and np.all(normals == [0.0, 0.0, 1.0])


@pytest.mark.parametrize("turned", [0.0, 0.6, np.pi / 2, 2.5])
def test_a_wheel_on_a_slope_stands_across_it(turned):
    """A disc on a plane: its middle is a radius away along the plane's normal, less what leans sideways."""
    slope = ramp(15.0, "up", start=0.1, length=3.0)
    normal = slope.regions[1].normal
    along = np.array([[np.cos(turned), np.sin(turned)]])
    heights, normals = Ground(slope).ride(np.array([[1.5, 0.2]]), along)
    np.testing.assert_allclose(normals[0], normal, atol=4e-3)
    rise = -(normal[:2] @ along[0]) / normal[2]
    assert heights[0] == pytest.approx(slope.height(1.5, 0.2) + WHEEL_RADIUS * np.hypot(1.0, rise), abs=1e-4)


def test_a_wheel_meets_a_step_before_it_is_above_it():
    def level(x0, x1, z):
        return Region(
            [[x0, -1, z], [x1, -1, z], [x1, 1, z], [x0, 1, z]], **dict.fromkeys(FRICTION, 0.5), group="g"
        )

    step = Terrain("step", (level(-1.0, 0.0, 0.0), level(0.0, 1.0, 0.05)))
    x = np.linspace(-0.2, 0.2, 81)
    heights, _ = Ground(step).ride(np.column_stack([x, 0 * x]), np.tile([1.0, 0.0], (len(x), 1)))
    exact = np.maximum(WHEEL_RADIUS, 0.05 + np.sqrt(np.clip(WHEEL_RADIUS**2 - x**2, 0.0, None)))
    exact[x >= 0.0] = 0.05 + WHEEL_RADIUS
    # It is looked at in places 1.5 cm apart: what it finds is right at most that far away.
    parabola = 7e-3  # it does not know an edge
    assert np.all(heights[:-4] <= exact[4:] + parabola)
    assert np.all(heights[4:] >= exact[:-4] - 1e-3)
    aside = np.abs(x) > WHEEL_RADIUS
    np.testing.assert_allclose(heights[aside], exact[aside], atol=1e-9)


def test_where_a_wheel_rides_is_where_mujoco_has_it():
    robot, terrain = Omni(waves(7)), waves(7)
    for x in (0.6, 1.3, 2.2):
        qpos = posture()
        qpos[[0, 2]] = x, 0.53 + PEAK
        robot.reset(qpos)
        for _ in range(400):
            robot.step(robot.servo(qpos[7:], np.zeros(23)))
        heights, _ = Ground(terrain).ride(robot.centres[:, :2], np.tile([1.0, 0.0], (4, 1)))
        loaded = robot.contact_wrenches()[:, 2] > 5.0
        assert loaded.sum() >= 2
        np.testing.assert_allclose(robot.centres[loaded, 2], heights[loaded], atol=0.003)


def test_the_robot_rolls_down_into_a_hollow():
    robot, qpos = Omni(waves(5)), posture()
    qpos[[0, 2]] = 1.15 + 0.05, 0.53 + PEAK
    robot.reset(qpos)
    for _ in range(400):
        robot.step(robot.servo(qpos[7:], np.zeros(23)))
    heights = robot.centres[:, 2] - WHEEL_RADIUS
    assert np.all(heights > wave_height(robot.centres[:, 0]) - 0.005)
    assert RUN_UP > 0.8
