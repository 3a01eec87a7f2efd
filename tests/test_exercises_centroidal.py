"""Chapter 1's checks: a right answer passes, plausible wrong ones are told what is wrong with them."""

import numpy as np
import pytest

from wfbook.centroidal import Robot
from wfbook.exercises import centroidal as check
from wfbook.exercises.answer import WrongAnswer

ROBOT = Robot.go1()


def test_the_nose_goes_up():
    assert "nose goes up" in check.nose(-40.0 * ROBOT.height)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (40.0 * ROBOT.height, "turn the nose down"),
        (0.0, "turn the nose nowhere"),
        (-10.0 * ROBOT.height, "torque of one leg"),
        (-3.0 * 40.0 * ROBOT.height, "not with 31.8 N m"),
        (None, "pitch_torque"),
    ],
)
def test_a_nose_that_goes_elsewhere(answer, message):
    with pytest.raises(WrongAnswer, match=message):
        check.nose(answer)


def test_torque_is_lever_cross_force():
    assert "right" in check.torque(lambda p, x, lam: np.cross(p - x, lam).sum(axis=0))


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (
            lambda p, x, lam: np.cross(x - p, lam).sum(axis=0),
            "only FL pushes: this is the torque on the ground",
        ),
        (lambda p, x, lam: np.cross(p, lam).sum(axis=0), "from the origin"),
        (lambda p, x, lam: np.cross(p - x, lam), r"shape \(4, 3\)"),
        (lambda p, x, lam: np.cross((p - x)[:2], lam[:2]).sum(axis=0), "only RL pushes, and the"),
        (lambda p, x, lam: np.cross(p - x, lam).sum(axis=0) * [1, 1, 0], "and the yaw torque is"),
        (lambda p, x, lam: np.cross(p.mean(0) - x, lam.sum(0)), "only FL pushes, and the"),
        (lambda p, x, lam: max(np.cross(p - x, lam), key=np.linalg.norm), "not their sum"),
    ],
)
def test_a_torque_that_is_another(function, message):
    with pytest.raises(WrongAnswer, match=message):
        check.torque(function)


def test_two_squares_bound_a_product():
    assert "right" in check.bounds(lambda r, F, s: ((s * r + F / s) ** 2, (s * r - F / s) ** 2))


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda r, F, s: ((s * r - F / s) ** 2, (s * r + F / s) ** 2), "are swapped"),
        (lambda r, F, s: ((r + F) ** 2, (r - F) ** 2), "not the least|s is not used"),
        (lambda r, F, s: ((s * r + F / s) ** 2 + 1, (s * r - F / s) ** 2 + 1), "not the least"),
        (lambda r, F, s: ((s * r + F) ** 2, (s * r - F) ** 2), "but the torque is"),
        (lambda r, F, s: (4 * r * F, 0.0), "can't be negative|instead of"),
        (lambda r, F, s: (r + F) ** 2, "shape"),
        (lambda r, F, s: ((r / s + F * s) ** 2, (r / s - F * s) ** 2), "not the least"),
    ],
)
def test_bounds_that_are_others(function, message):
    with pytest.raises(WrongAnswer, match=message):
        check.bounds(function)


def forces(push=0.25, shift=1.0, lift=1.0):
    """Forces to set off with: shares of push, of the load that moves to the rear, and of the weight."""
    move = shift * ROBOT.mass * ROBOT.height / (4 * ROBOT.stance[0, 0])
    lam = np.tile([push * ROBOT.mass, 0.0, lift * ROBOT.weight / 4], (4, 1))
    lam[:, 2] += [-move, -move, move, move]
    return lam


def test_one_can_set_off_level():
    assert "sets off level" in check.set_off(forces())
    rear = forces()
    rear[:, 0] = [0.0, 0.0, ROBOT.mass / 2, ROBOT.mass / 2]
    assert "sets off level" in check.set_off(rear), "any legs may push"


def changed(leg, axis, by):
    lam = forces()
    lam[leg, axis] += by
    return lam


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (forces(shift=0.0), "eq. 8, pitch: the robot is turned nose up by 3.52 N m"),
        (forces(shift=-1.0), "nose up by 7.05"),
        (forces(shift=2.0), "nose down"),
        (forces(push=0.0), r"eq. 1, x: .* \+0.00 m/s² instead of \+1.00"),
        (forces(lift=0.5), "eq. 1, z"),
        (changed(2, 2, -200.0), "RL pulls at the ground"),
        (changed(1, 1, 60.0), "FR slips"),
        (changed(0, 0, 10.0), "eq. 1, x"),
        (
            changed(0, 2, 10.0) + changed(1, 2, -10.0) - forces(),
            "eq. 8, roll: the robot is turned to its right",
        ),
        (changed(0, 0, 3.0) + changed(1, 0, -3.0) - forces(), "eq. 8, yaw: the robot is turned to its right"),
        (np.zeros((3, 4)), "shape"),
    ],
)
def test_setting_off_otherwise(answer, message):
    with pytest.raises(WrongAnswer, match=message):
        check.set_off(answer)


def test_there_is_a_right_price():
    assert "tight at 0.02" in check.charge(0.02)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (0.005, "pitch torque that no leg makes"),
        (0.1, "for nothing"),
        (0.0, "not between"),
        ("dear", "charge"),
    ],
)
def test_wrong_prices(answer, message):
    with pytest.raises(WrongAnswer, match=message):
        check.charge(answer)
