"""Eqs 1 and 8 against MuJoCo: momentum of all bodies, and what contact forces do to it."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from wfbook.centroidal import GRAVITY, Robot
from wfbook.go1 import RADII, Go1, momenta, nominal
from wfbook.go1_dynamics import MOTORS, Go1Dynamics
from wfbook.runs import momentum_of
from wfbook.terrain import flat
from wfbook.view.drawings.centroidal import momentum_check

RNG = np.random.default_rng(5)


def posture(height):
    """The nominal stance with its feet this far above the ground."""
    dynamics, robot = Go1Dynamics(), Robot.go1()
    feet = np.column_stack([robot.stance, np.full(4, height + RADII[0])])
    return dynamics.posture(np.array([0.0, 0.0, robot.height + height]), np.zeros(3), feet)


def test_momentum_is_what_pinocchio_finds():
    dynamics = Go1Dynamics()
    qpos = np.tile(posture(0.5), (5, 1))
    qpos[:, 3:7] = RNG.normal(size=(5, 4))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    qpos[:, 7:] += RNG.normal(0.0, 0.3, (5, 16))
    qvel = RNG.normal(size=(5, 22))
    linear, angular = momenta(qpos, qvel)
    for k in range(5):
        expected = pin.computeCentroidalMomentum(
            dynamics.model, dynamics.data, *dynamics.state(qpos[k], qvel[k])
        )
        np.testing.assert_allclose(linear[k], expected.linear, atol=1e-9)
        np.testing.assert_allclose(angular[k], expected.angular, atol=1e-9)


def test_a_robot_in_the_air_falls_like_a_stone_and_can_not_turn_itself_whatever_its_legs_do():
    robot = Go1(flat())
    robot.reset(posture(2.0), np.zeros(4, int))
    qpos, qvel = [], []
    for k in range(300):
        robot.step(2.0 * np.sin(0.05 * k + np.arange(12)))
        qpos.append(robot.data.qpos.copy())
        qvel.append(robot.data.qvel.copy())
    linear, angular = momenta(np.array(qpos), np.array(qvel))
    mass = Robot.go1().mass
    assert np.abs(np.diff(np.array(qpos)[:, 7:], axis=0)).sum() > 5.0, "the legs move a lot"
    np.testing.assert_allclose(linear[-1], [0.0, 0.0, -0.3 * mass * GRAVITY], atol=0.1)
    assert np.abs(angular).max() < 0.02


@pytest.fixture(scope="module")
def landing():
    """A robot that lands on its feet after a fall of two centimetres, logged as a run is."""
    robot, dynamics = Go1(flat()), Go1Dynamics()
    stance = np.asarray(nominal()["joint_angles"])
    robot.reset(posture(0.02), np.zeros(4, int))
    log = {name: [] for name in ("t", "qpos", "qvel", "com", "p", "contact_force")}
    robot.data.qvel[0] = 0.3
    for k in range(400):
        qpos, qvel = robot.data.qpos.copy(), robot.data.qvel.copy()
        dynamics.update(qpos, qvel)
        points = robot.centres - [0.0, 0.0, RADII[0]]
        sample = (1e-3 * k, qpos, qvel, dynamics.com, points, robot.contact_forces())
        for values, value in zip(log.values(), sample, strict=True):
            values.append(value)
        robot.step(60.0 * (stance - qpos[1 + MOTORS]) - 2.0 * qvel[MOTORS])
    return SimpleNamespace(**{name: np.array(values) for name, values in log.items()})


def test_the_contact_forces_of_a_landing_explain_its_motion(landing):
    momentum = momentum_of(landing)
    assert np.ptp(momentum.velocity[:, 2]) > 0.5, "it was stopped"
    assert np.abs(momentum.angular[:, 1]).max() > 0.1, "and pitched, for its feet stopped first"
    np.testing.assert_allclose(momentum.predicted.v, momentum.velocity, atol=0.02)
    np.testing.assert_allclose(momentum.predicted.momentum, momentum.angular, atol=0.02)
    assert np.abs(momentum.trunk - momentum.angular).max() > 0.05, "legs have angular momentum of their own"


def test_the_check_draws_what_it_compares(landing):
    momentum = momentum_of(landing)
    picture = momentum_check(momentum)
    for axis in range(3):
        left, right = picture.axes[2 * axis : 2 * axis + 2]
        lines = {line.get_gid(): line.get_ydata() for line in (*left.lines, *right.lines)}
        assert lines.keys() == {"measured", "eq. 1", "eq. 8", "rigid"}
        np.testing.assert_array_equal(lines["eq. 8"], momentum.predicted.momentum[:, axis])
        np.testing.assert_array_equal(lines["eq. 1"], momentum.predicted.v[:, axis])
        np.testing.assert_array_equal(lines["rigid"], momentum.trunk[:, axis])
