"""The checks of chapter 6: right answers pass, wrong ones hear what is wrong."""

import numpy as np
import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import control as check
from wfbook.reference import Gains


def refused(match, function, *answer):
    with pytest.raises(WrongAnswer, match=match):
        function(*answer)


class Outcome:
    """What a simulation says: fallen or not, and level."""

    def __init__(self, fell):
        self.metrics, self.rpy = {"fell": fell}, np.zeros((2, 3))


def test_the_delay(monkeypatch):
    assert "26.5 ms" in check.first_fall(27.0)
    # The wrong answers need no simulation: what the robot does at 24 and 30 ms has just been seen.
    monkeypatch.setattr(check, "simulated", lambda setting: Outcome(setting.delay_ms > 27.0))
    refused("with 15 ms the robot still bears", check.first_fall, 12.0)
    refused("with 37 ms the robot already", check.first_fall, 40)
    refused("Between 0 and 60", check.first_fall, -1.0)
    refused("not an array of numbers", check.first_fall, "late")


def test_what_gives_first():
    assert "FL uses all its friction" in check.gives_first("front", "friction")
    refused("weight goes to the other pair", check.gives_first, "rear", "friction")
    refused("FR uses all its friction", check.gives_first, "front", "lift")
    refused("share of what it carries", check.gives_first, "rear", "torque")
    refused("neither 'front' nor 'rear'", check.gives_first, "left", "friction")
    refused("none of", check.gives_first, "front", "grip")


def sides(grip):
    return np.array([[1, 0, -grip], [-1, 0, -grip], [0, 1, -grip], [0, -1, -grip], [0, 0, -1]])


def test_friction_rows():
    assert "5 rows" in check.friction_rows(lambda mu: sides(mu / np.sqrt(2)))
    octagon = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.arange(8) * np.pi / 4])

    def eight(mu):
        return octagon - [0.0, 0.0, mu * np.cos(np.pi / 8)]

    assert "8 rows" in check.friction_rows(eight)
    refused(r"45.0° from t your rows allow 1.41 times", check.friction_rows, sides)
    refused(r"at 0.0° from t your rows allow 0.50", check.friction_rows, lambda mu: sides(mu / 2))
    refused("may pull", check.friction_rows, lambda mu: -sides(mu / 2))
    refused("allow inf times", check.friction_rows, lambda mu: sides(mu / 2)[[0, 2, 4]])
    refused("shape", check.friction_rows, lambda mu: np.ones((4, 2)))
    refused("for μ = 0.3", check.friction_rows, lambda mu: sides(0.7 / np.sqrt(2)))


def leg(thigh, calf, thigh_rate, calf_rate, link=0.213):
    angles, rates = np.array([thigh, thigh + calf]), np.array([thigh_rate, thigh_rate + calf_rate])
    sine, cosine = link * np.sin(angles), link * np.cos(angles)
    J = np.array([[-cosine.sum(), -cosine[1]], [sine.sum(), sine[1]]])
    return J, np.array([sine @ rates**2, cosine @ rates**2])


def test_leg_jacobian():
    assert "agree" in check.leg_jacobian(leg)
    refused(r"drift\[0\] is 0.0000", check.leg_jacobian, lambda *a: (leg(*a)[0], np.zeros(2)))
    refused(
        r"J\[0, 0\].*thigh a little moves the foot ahead",
        check.leg_jacobian,
        lambda *a: (-leg(*a)[0], np.zeros(2)),
    )
    refused("drift has the shape", check.leg_jacobian, lambda *a: (leg(*a)[0], 0.0))
    refused("two things", check.leg_jacobian, lambda *a: leg(*a)[0])
    refused(r"J\[0, 1\]|J\[1, 0\]|J\[0, 0\]", check.leg_jacobian, lambda *a: (leg(*a)[0].T, leg(*a)[1]))

    def without_coupling(thigh, calf, thigh_rate, calf_rate):
        J, _ = leg(thigh, calf, thigh_rate, calf_rate)
        return J, 0.213 * np.array([np.sin(thigh) * thigh_rate**2 + np.sin(thigh + calf) * calf_rate**2, 0.0])

    refused(r"drift\[0\]", check.leg_jacobian, without_coupling)


def gains(kp, kd, ki=0.0, com=(100.0, 28.0), **others):
    return Gains(
        attitude_kp=np.full(3, kp),
        attitude_kd=np.full(3, kd),
        attitude_ki=np.full(3, ki),
        com_kp=np.array([com[0], com[0], 400.0]),
        com_kd=np.array([com[1], com[1], 40.0]),
        **others,
    )


def test_a_slow_computer():
    assert "upright at 30 ms" in check.slow_computer(gains(400.0, 38.0))
    refused("attitude, axis x: these gains bear 26.5 ms", check.slow_computer, Gains())
    refused("force_weight is changed", check.slow_computer, gains(400.0, 38.0, force_weight=1.0))
    refused("not wfbook.reference.Gains", check.slow_computer, {"com_kp": 3})
    refused("negative", check.slow_computer, gains(-400.0, 38.0))
    refused("pushed away by", check.slow_computer, gains(400.0, 38.0, com=(50.0, 14.0)))
