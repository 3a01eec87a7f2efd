"""The friction pyramid and rolling friction (Paper A, eqs 26 and 29)."""

import numpy as np
import pytest

from wfbook.friction import (
    friction_cone,
    friction_pyramid,
    ground_force,
    inner_coefficient,
    rolling_friction,
    steepest_slope,
    support_on_slope,
)
from wfbook.standing import plane


def test_the_pyramid_is_the_set_the_paper_writes():
    """Eq. 26, for forces all around."""
    n, t, b = np.random.default_rng(0).uniform(-1, 1, (3, 20000))
    inside = np.max(friction_pyramid(n, t, b, 0.1, 0.7), axis=0) <= 0
    np.testing.assert_array_equal(inside, (n >= 0) & (np.abs(t) <= 0.1 * n) & (np.abs(b) <= 0.7 * n))
    assert inside.any()


def test_rolling_friction_opposes_forward_rolling():
    """Eq. 29, with its sign corrected."""
    assert rolling_friction(50.0, 0.01) == -0.5


def test_rolling_friction_takes_power_both_ways():
    velocity = np.array([-2.0, -0.1, 0.3])
    assert (rolling_friction(30.0, 0.02, np.sign(velocity)) * velocity < 0).all()


def test_the_cone_is_inside_its_pyramid_and_contains_the_inner_ones():
    n, t, b = np.random.default_rng(1).uniform(-1, 1, (3, 20000))
    mu_t, mu_b = 0.3, 0.7
    cone = friction_cone(n, t, b, mu_t, mu_b) <= 0
    outer = np.max(friction_pyramid(n, t, b, mu_t, mu_b), axis=0) <= 0
    inner = np.max(friction_pyramid(n, t, b, inner_coefficient(mu_t), inner_coefficient(mu_b)), axis=0) <= 0
    assert (cone <= outer).all() and (inner <= cone).all()
    assert inner.sum() < cone.sum() < outer.sum()
    np.testing.assert_array_equal(cone, (n >= 0) & ((t / mu_t) ** 2 + (b / mu_b) ** 2 <= n**2))


def test_a_wheels_cone_is_a_line():
    assert friction_cone(1.0, 0.0, 0.5, 0.0, 0.7) <= 0
    assert friction_cone(1.0, 1e-9, 0.5, 0.0, 0.7) > 0 and friction_cone(1.0, 0.0, 0.8, 0.0, 0.7) > 0


@pytest.mark.parametrize("sides", [3, 4, 8, 20])
def test_edges_of_the_inner_pyramid_are_on_the_cone(sides):
    edge = inner_coefficient(0.6, sides) / np.cos(np.pi / sides)
    assert friction_cone(2.0, 2.0 * edge, 0.0, 0.6, 0.6) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("heading", np.linspace(0.0, 2 * np.pi, 9))
@pytest.mark.parametrize("cone", [False, True])
def test_the_steepest_slope_is_where_holding_becomes_inadmissible(heading, cone):
    for mu_t in (0.0, 0.4):
        angle = steepest_slope(mu_t, 0.5, heading, cone)
        for step, inside in ((-1e-4, True), (1e-4, False)):
            if angle + step <= 0:
                continue
            force = support_on_slope(angle + step, heading)
            excess = friction_cone(*force, mu_t, 0.5) if cone else max(friction_pyramid(*force, mu_t, 0.5))
            # Straight across, the sine of π is not quite zero for a wheel without traction.
            assert (excess <= 1e-12) == inside or (mu_t == 0.0 and abs(np.cos(heading)) < 1e-12)


def test_holding_on_a_slope_returns_the_weight():
    region = plane(0.5, slope=0.2).regions[0]
    n, t, b = support_on_slope(0.2)
    force = n * region.normal + t * region.tangent + b * region.binormal
    assert force == pytest.approx([0.0, 0.0, 1.0])


def test_the_ground_gives_what_is_inside_and_its_most_of_what_is_not():
    assert ground_force([10.0, 2.0, 3.0], 0.5, 0.5) == pytest.approx([10.0, 2.0, 3.0])
    assert ground_force([10.0, 6.0, 8.0], 0.5, 0.5) == pytest.approx([10.0, 3.0, 4.0])
    assert ground_force([10.0, 6.0, -8.0], 0.0, 0.5) == pytest.approx([10.0, 0.0, -5.0])
    assert ground_force([-1.0, 6.0, 0.0], 0.5, 0.5) == pytest.approx(np.zeros(3))
