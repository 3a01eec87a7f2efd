"""Chapter 2's exercises: right answers pass, plausible wrong ones are told what is wrong."""

import numpy as np
import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import swing as check
from wfbook.swing import quintic_basis


def test_the_factor():
    assert "8 times" in check.grows(8)
    for wrong, message in (
        (2, "half the time"),
        (4, "velocity"),
        (16, "squared"),
        ("eight", "array of numbers"),
    ):
        with pytest.raises(WrongAnswer, match=message):
            check.grows(wrong)


def solution(p0, v0, pf, vf, T):
    powers = np.arange(6)
    rows = []
    for t in (0.0, T):
        rows.append(t**powers)
        rows.append(powers * t ** np.maximum(powers - 1, 0))
        rows.append(powers * (powers - 1) * t ** np.maximum(powers - 2, 0))
    return np.linalg.solve(np.array(rows, float), [p0, v0, 0.0, pf, vf, 0.0])


def test_the_coefficients():
    assert "20 random swings" in check.solves(solution)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda p0, v0, pf, vf, T: solution(p0, v0, pf, vf, 1.0), "at touch-down"),
        (
            lambda p0, v0, pf, vf, T: solution(p0, v0, pf, vf, 1.0) / T ** np.arange(6),
            "by time, not by phase",
        ),
        (lambda p0, v0, pf, vf, T: solution(p0, v0, pf, vf, T)[::-1], "at lift-off .* the position"),
        (lambda p0, v0, pf, vf, T: solution(p0, 0.0, pf, 0.0, T), "the velocity is 0.000"),
        (lambda p0, v0, pf, vf, T: solution(p0, v0, pf, vf, T)[:4], r"shape \(4,\), not \(6,\)"),
        (
            lambda p0, v0, pf, vf, T: np.r_[np.polyfit([0, T], [p0, pf], 1)[::-1], np.zeros(4)],
            "the velocity",
        ),
    ],
)
def test_wrong_coefficients(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.solves(wrong)


def wheel(phase, duration, speed, landing=0.05, start=1.0, end=1.0, rolls=1.0, smoothness=2):
    goal = rolls * speed * duration + landing
    ends = [0.0, duration * speed * start, goal, duration * speed * end]
    return quintic_basis(phase, smoothness=smoothness) @ ends


def test_the_rolling_swing():
    assert "comes back at rest" in check.rolls(wheel)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"rolls": 0.0}, "the robot rolls on"),
        ({"start": 0.0}, "the wheel lifts with -?0.00 m/s"),
        ({"end": 0.0}, "the wheel lands with -?0.00 m/s"),
        ({"smoothness": 1}, "acceleration is"),
        ({"landing": 0.0}, "it lands at"),
    ],
)
def test_wrong_rolling_swings(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.rolls(lambda phase, duration, speed: wheel(phase, duration, speed, **wrong))


def test_the_step_over_the_box():
    assert "mm of room" in check.clears(0.085, 0.275)


@pytest.mark.parametrize(
    ("apex", "duration", "message"),
    [
        (0.06, 0.28, "from the box"),
        (0.12, 0.28, "thigh's motor"),
        (0.075, 0.25, "is met with"),
        (0.085, 0.4, "at most 0.28 s"),
        (0.085, 0.12, "motor gives"),
        (-0.1, 0.28, "not between"),
    ],
)
def test_wrong_steps(apex, duration, message):
    with pytest.raises(WrongAnswer, match=message):
        check.clears(apex, duration)
