"""The planner's program at one instant: eqs 1 and 8 hold, the price of torque is capped, the bound is one."""

import numpy as np
import pytest

from wfbook.centroidal import GRAVITY, Robot
from wfbook.planner.instant import Instant

ROBOT = Robot.go1()
FOUR = Instant(ROBOT)
PAIR = Instant(ROBOT, (0, 3))
TASKS = [
    (FOUR, (-3.0, 0.0, 0.0), (0.0, 0.0)),
    (FOUR, (0.5, 0.8, 0.0), (0.0, 0.02)),
    (PAIR, (0.0, 0.0, 0.0), (0.06, 0.0)),
]


@pytest.mark.parametrize(("instant", "a", "pull"), TASKS)
@pytest.mark.parametrize("charge", [0.002, 0.05])
def test_forces_accelerate_as_demanded_and_the_true_ones_do_not_turn(instant, a, pull, charge):
    for stance in (instant.relaxed(a, charge, pull), instant.true(a, charge, pull)):
        total = stance.lam.sum(axis=0) / ROBOT.mass + [0.0, 0.0, -GRAVITY]
        np.testing.assert_allclose(total, a, atol=1e-4)
        np.testing.assert_allclose(stance.claimed, 0.0, atol=1e-3)
        np.testing.assert_allclose(np.cross(stance.lever, stance.lam).sum(axis=0), stance.real, atol=1e-9)
        assert stance.lam[:, 2].min() > -1e-3
        np.testing.assert_allclose(stance.lever + stance.offset, instant.contacts, atol=1e-12)
    np.testing.assert_allclose(stance.real, 0.0, atol=1e-3)


@pytest.mark.parametrize(("instant", "a", "pull"), TASKS)
def test_the_relaxed_cost_bounds_the_true_one_and_meets_it_where_it_is_tight(instant, a, pull):
    for charge in (0.001, 0.01, 0.1):
        relaxed, true = instant.relaxed(a, charge, pull), instant.true(a, charge, pull)
        assert relaxed.cost <= true.cost + 1e-7
        if np.linalg.norm(relaxed.fictitious) < 1e-3:
            assert relaxed.cost == pytest.approx(true.cost, rel=1e-5)
            np.testing.assert_allclose(relaxed.lam, true.lam, atol=0.1)


@pytest.mark.parametrize(("instant", "a", "pull"), TASKS)
def test_the_price_of_torque_is_what_a_little_more_of_it_costs_and_never_above_four_charges(instant, a, pull):
    for charge in (0.001, 0.004, 0.02, 0.08):
        stance = instant.relaxed(a, charge, pull)
        assert (stance.price <= 4.0 * charge * 1.001).all()
        opened = np.abs(stance.fictitious) > 0.05
        np.testing.assert_allclose(stance.price[opened], 4.0 * charge, rtol=1e-3)


def test_a_mirrored_task_has_a_mirrored_answer():
    left, right = (FOUR.relaxed((0.5, side * 2.0, 0.0), 0.002) for side in (1.0, -1.0))
    np.testing.assert_allclose(left.lam[[1, 0, 3, 2]] * [1.0, -1.0, 1.0], right.lam, atol=0.05)
    np.testing.assert_allclose(left.offset * [1.0, -1.0, 1.0], right.offset, atol=1e-4)


def test_what_can_not_be_is_refused():
    with pytest.raises(ValueError, match="no forces of the legs give"):
        FOUR.relaxed((0.0, 0.0, -12.0))
    with pytest.raises(ValueError, match="turns the robot"):
        PAIR.true((0.0, 12.0, 0.0))
