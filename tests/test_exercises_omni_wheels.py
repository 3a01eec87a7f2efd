"""Chapter 9's checks: right answers pass, wrong ones are told what is wrong."""

import numpy as np
import pytest

from wfbook.exercises import omni_wheels as check
from wfbook.exercises.answer import WrongAnswer
from wfbook.omni.wheels import body_twist, rotation, twist_about


def nearer(desired, current):
    turn = (desired - current + np.pi) % (2 * np.pi) - np.pi
    if abs(turn) <= np.pi / 2:
        return current + turn, 1
    return current + turn - np.sign(turn) * np.pi, -1


def printed(desired, current):
    return (desired, 1) if abs(desired - current) <= np.pi / 2 else (desired + np.pi, -1)


def only_forward(desired, current):
    return current + (desired - current + np.pi) % (2 * np.pi) - np.pi, 1


def wrong_sign(desired, current):
    return nearer(desired, current)[0], 1


def odometry(steering, speed, positions):
    return body_twist(steering, speed, positions)[0]


def mean_velocity(steering, speed, positions):
    v = np.mean(speed[:, None] * np.column_stack([np.cos(steering), np.sin(steering)]), axis=0)
    return np.array([*v, 0.0])


def rolling_rows_only(steering, speed, positions):
    e = np.column_stack([np.cos(steering), np.sin(steering)])
    J = np.array([[0.0, -1.0], [1.0, 0.0]])
    return np.linalg.pinv(np.column_stack([e, np.sum(e * (positions @ J.T), axis=1)])) @ speed


def test_right_answers():
    assert check.ranks((2, 2, 3)).startswith("Right")
    assert check.nears(nearer).startswith("Right")
    assert check.measures(odometry).startswith("Right")
    assert check.orbits(twist_about(np.array([1.0, 0.0]), 0.6)).startswith("Right")
    assert check.orbits(np.array([0.0, 0.55, -0.55])).startswith("Right")


@pytest.mark.parametrize(
    "answer, says",
    [
        ((3, 3, 3), "driving straight: not 3.*across"),
        ((2, 3, 3), "crabbing: not 3"),
        ((1, 2, 3), "driving straight: not 1.*opposite spins"),
        ((2, 2, 1), "turning in place: not 1.*in the mean"),
        ("two", "not an array"),
    ],
)
def test_wrong_ranks(answer, says):
    with pytest.raises(WrongAnswer, match=says):
        check.ranks(answer)


@pytest.mark.parametrize(
    "function, says",
    [
        (printed, "179°, present -179°: it turns by 538°|desired 179°.*difference between"),
        (only_forward, "it turns by .*°"),
        (wrong_sign, "with sign 1 it rolls to"),
        (lambda d, c: (d, 0), "the sign is 0"),
        (lambda d, c: d, "shape"),
    ],
)
def test_wrong_turns(function, says):
    with pytest.raises(WrongAnswer, match=says):
        check.nears(function)


@pytest.mark.parametrize(
    "function, says",
    [
        (mean_velocity, "omega|v_x|v_y"),
        (lambda s, v, p: np.array([*odometry(s, v, p)[:2], 0.0]), "omega is 0.00; a turn moves"),
        (lambda s, v, p: -odometry(s, v, p), "is "),
        (rolling_rows_only, "is |all eight rows"),
        (None, "not a function"),
    ],
)
def test_wrong_odometry(function, says):
    with pytest.raises(WrongAnswer, match=says):
        check.measures(function)


@pytest.mark.parametrize(
    "twist, says",
    [
        (np.array([0.0, 0.5, 0.0]), "does not turn"),
        (np.array([0.0, 0.5, 0.5]), "faces"),
        (np.array([0.3, 0.55, -0.55]), "from the object instead of 1 m"),
        (rotation(0.5), "faces"),
        (np.array([0.0, 0.7, -0.7]), "wheel rolls at 0.9. m/s, more than"),
        (np.array([0.0, 0.3, -0.3]), "a quarter turn takes 5.2 s"),
        (np.array([0.0, 0.3]), "shape"),
    ],
)
def test_wrong_orbits(twist, says):
    with pytest.raises(WrongAnswer, match=says):
        check.orbits(twist)
