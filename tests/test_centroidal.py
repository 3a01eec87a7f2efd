"""Chapter 1's equations as numbers: Newton, the midpoint rule, torque and its convex bounds."""

import numpy as np
import pytest

from wfbook.centroidal import (
    GRAVITY,
    Robot,
    bound_terms,
    carried,
    cheapest_claim,
    contact_torque,
    least_bounds,
    linear_dynamics,
    midpoint_integration,
    roll_out,
)

RNG = np.random.default_rng(3)


def test_standing_still_takes_the_robot_s_weight():
    mass, K, L = 13.0, 4, 4
    lam = [np.zeros((K, L)), np.zeros((K, L)), np.full((K, L), mass * GRAVITY / L)]
    none = [np.zeros((K, L))] * 3
    for residual in linear_dynamics([np.zeros(K)] * 3, lam, none, mass):
        np.testing.assert_allclose(residual, 0.0, atol=1e-12)


def test_a_push_accelerates_by_force_over_mass():
    """Eq. 1, by plain algebra."""
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
    """Eq. 8 is NumPy's cross product."""
    lever, lam = RNG.normal(size=(2, 3, 6, 4))
    expected = np.cross(np.moveaxis(lever, 0, -1), np.moveaxis(lam, 0, -1))
    np.testing.assert_allclose(np.stack(contact_torque(lever, lam), axis=-1), expected, atol=1e-12)


@pytest.mark.parametrize("scale", [0.1, 1.0, 11.0])
def test_the_bounds_differ_by_four_times_the_torque(scale):
    """Eq. 9, at any scale."""
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


def test_rolling_out_is_the_midpoint_rule_solved_for_what_comes_next():
    K, L, dt = 7, 4, 0.1
    p, lam = RNG.normal(size=(K + 1, L, 3)), 30.0 * RNG.normal(size=(K, L, 3))
    motion = roll_out(13.0, dt, p, lam, x=np.array([0.1, 0.0, 0.3]), v=np.array([0.2, 0.0, -0.1]))
    residuals = midpoint_integration(motion.x.T, motion.v.T, motion.a.T, dt)
    np.testing.assert_allclose(np.concatenate(residuals), 0.0, atol=1e-12)
    still = [np.zeros((K, L))] * 3
    np.testing.assert_allclose(
        linear_dynamics(motion.a.T, np.moveaxis(lam, -1, 0), still, 13.0), 0.0, atol=1e-12
    )
    # Angular momentum about the origin changes by all forces' and the weight's torque about the origin.
    about_origin = motion.momentum + 13.0 * np.cross(motion.x, motion.v)
    middle = 0.5 * (p[1:] + p[:-1])
    arms = 0.5 * (motion.x[1:] + motion.x[:-1])
    torque = np.cross(middle, lam).sum(axis=1) + np.cross(arms, [0.0, 0.0, -13.0 * GRAVITY])
    np.testing.assert_allclose(np.diff(about_origin, axis=0), dt * torque, atol=1e-9)


def test_a_body_turns_by_half_of_what_its_last_rate_would():
    inertia, knots = np.diag([0.2, 0.4, 0.5]), 10
    p = np.tile([0.0, 0.0, 0.0], (knots + 1, 1, 1))
    lam = np.tile([5.0, 0.0, 0.0], (knots, 1, 1))
    motion = roll_out(13.0, 0.02, p, lam, x=np.tile([0.0, 0.0, 0.3], (knots + 1, 1)))
    torque = -0.3 * 5.0
    np.testing.assert_allclose(motion.torque, [[0.0, torque, 0.0]] * knots, atol=1e-12)
    assert motion.angles(inertia)[-1] == pytest.approx([0.0, 0.5 * torque / 0.4 * 0.2**2, 0.0])


@pytest.mark.parametrize("scale", [0.5, 1.0, 3.0])
def test_the_least_bounds_differ_by_the_torque_and_are_squares(scale):
    lever, lam = RNG.normal(size=(2, 3, 6, 4))
    up, down = least_bounds(lever, lam, scale)
    for torque, high, low in zip(contact_torque(lever, lam), up, down, strict=True):
        np.testing.assert_allclose((high - low) / 4, torque, atol=1e-10)
        assert (high >= 0.0).all() and (low >= 0.0).all()


@pytest.mark.parametrize("seed", range(5))
def test_what_legs_carry_turns_the_robot_least(seed):
    rng = np.random.default_rng(seed)
    p, x = np.column_stack([rng.normal(size=(4, 2)), np.zeros(4)]), np.array([*rng.normal(size=2), 0.3])
    best = carried(p, x, 100.0)
    assert best.sum() == pytest.approx(100.0) and best.min() >= 0.0

    def left(loads):
        return np.linalg.norm(loads @ (p - x)[:, :2])

    for loads in 100.0 * rng.dirichlet(np.ones(4), 200):
        assert left(best) <= left(loads) + 1e-3


@pytest.mark.parametrize(("real", "wanted"), [(6.0, 12.0), (6.0, -3.0), (-2.0, -2.1)])
@pytest.mark.parametrize("charge", [0.0, 0.3, 2.0])
def test_the_cheapest_claim_is_the_cheapest(real, wanted, charge):
    def cost(claimed):
        return 4 * charge * abs(claimed - real) + 2.0 * (wanted - claimed) ** 2 / 2

    best = cheapest_claim(real, wanted, charge, value=2.0)
    assert all(cost(best) <= cost(other) + 1e-9 for other in np.linspace(-20.0, 20.0, 801))
