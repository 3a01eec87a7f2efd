"""Chapter 1's equations as numbers: Newton, the midpoint rule, torque and its convex bounds."""

import numpy as np
import pytest

from wfbook.centroidal import (
    GRAVITY,
    Robot,
    bound_terms,
    contact_torque,
    linear_dynamics,
    midpoint_integration,
)

RNG = np.random.default_rng(3)


def test_standing_still_takes_the_robot_s_weight():
    mass, K, L = 13.0, 4, 4
    lam = [np.zeros((K, L)), np.zeros((K, L)), np.full((K, L), mass * GRAVITY / L)]
    none = [np.zeros((K, L))] * 3
    for residual in linear_dynamics([np.zeros(K)] * 3, lam, none, mass):
        np.testing.assert_allclose(residual, 0.0, atol=1e-12)


def test_a_push_accelerates_by_force_over_mass():
    lam, f = ([RNG.normal(size=(5, 4)) for _ in range(3)] for _ in range(2))
    a = [(lam[i] + f[i]).sum(axis=1) / 2.5 + (0.0, 0.0, -GRAVITY)[i] for i in range(3)]
    np.testing.assert_allclose(linear_dynamics(a, lam, f, 2.5), 0.0, atol=1e-12)


def test_the_midpoint_rule_is_exact_for_constant_acceleration():
    t, a = np.linspace(0.0, 1.0, 11), np.array([0.3, -2.0, 1.0])
    v = [0.1 + a_i * t for a_i in a]
    x = [0.5 + 0.1 * t + 0.5 * a_i * t**2 for a_i in a]
    np.testing.assert_allclose(
        midpoint_integration(x, v, [np.full(10, a_i) for a_i in a], 0.1), 0.0, atol=1e-12
    )


def test_torque_is_lever_cross_force():
    lever, lam = RNG.normal(size=(2, 3, 6, 4))
    expected = np.cross(np.moveaxis(lever, 0, -1), np.moveaxis(lam, 0, -1))
    np.testing.assert_allclose(np.stack(contact_torque(lever, lam), axis=-1), expected, atol=1e-12)


@pytest.mark.parametrize("scale", [0.1, 1.0, 11.0])
def test_the_bounds_differ_by_four_times_the_torque(scale):
    lever, lam = RNG.normal(size=(2, 3, 6, 4))
    plus, minus = ([sum(z**2 for z in pair) for pair in side] for side in bound_terms(lever, lam, scale))
    for torque, up, down in zip(contact_torque(lever, lam), plus, minus, strict=True):
        np.testing.assert_allclose((up - down) / 4, torque, atol=1e-10)


def test_the_go1_is_left_right_symmetric_and_its_reach_holds_its_stance():
    robot = Robot.go1()
    np.testing.assert_allclose(robot.stance[[1, 0, 3, 2]] * [1, -1], robot.stance, atol=1e-3)
    nominal = np.column_stack([robot.stance, np.full(4, -robot.height)])
    assert (robot.reach_lower < nominal).all() and (nominal < robot.reach_upper).all()
    assert np.linalg.eigvalsh(robot.inertia).min() > 0
