"""Chapter 7's checks: right answers pass, plausible wrong ones are told what is wrong."""

import estimation_cases
import numpy as np
import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import estimation as check
from wfbook.go1_dynamics import skew
from wfbook.recording import record


@pytest.fixture(scope="module")
def walked():
    return record(estimation_cases.walk(), seed=1)


def step(v, P, a, z, dt, sigma_a, sigma_z):
    v, P = v + a * dt, P + (sigma_a * dt) ** 2
    K = P / (P + sigma_z**2)
    return v + K * (z - v), (1 - K) * P


def residual(v, R_wb, stick_rate, spin, lever):
    stick, omega = R_wb @ stick_rate, R_wb @ spin
    e = v + stick - np.cross(omega, lever)
    return e, np.hstack([np.eye(3), -skew(stick) - skew(lever) @ skew(omega)])


def test_right_answers_pass(walked):
    assert "0.22 m/s" in check.printed_speed(0.6 / np.e)
    assert check.forgotten_rolling(walked, -7.5).startswith("Right: -")
    assert check.forgotten_rolling(walked, -12.0, radius=0.033).startswith("Right: -")
    assert check.kalman_step(step).startswith("Right")
    assert check.rolling(residual).startswith("Right")
    assert check.honest_noise(3.2).startswith("Right")


@pytest.mark.parametrize(
    "guess, says",
    [
        (0.6, "encoders"),
        (0.0, "not at once"),
        (0.4, "v' = −v"),
        (None, "not an array|not a finite"),
        ("fast", "not an array"),
    ],
)
def test_wrong_speeds(guess, says):
    with pytest.raises(WrongAnswer, match=says):
        check.printed_speed(guess)


@pytest.mark.parametrize(
    "percent, says", [(7.0, "wrong sign"), (-0.5, "too small"), (-40.0, "too large"), (None, "percent")]
)
def test_wrong_shares_of_the_way(walked, percent, says):
    with pytest.raises(WrongAnswer, match=says):
        check.forgotten_rolling(walked, percent)


def no_prediction(v, P, a, z, dt, sigma_a, sigma_z):
    return step(v, P, 0.0, z, dt, sigma_a, sigma_z)


def no_growth(v, P, a, z, dt, sigma_a, sigma_z):
    return step(v, P, a, z, dt, 0.0, sigma_z)


def old_innovation(v, P, a, z, dt, sigma_a, sigma_z):
    P = P + (sigma_a * dt) ** 2
    K = P / (P + sigma_z**2)
    return v + a * dt + K * (z - v), (1 - K) * P


def not_squared(v, P, a, z, dt, sigma_a, sigma_z):
    P = P + sigma_a * dt
    K = P / (P + sigma_z)
    return v + a * dt + K * (z - v - a * dt), (1 - K) * P


def growing(v, P, a, z, dt, sigma_a, sigma_z):
    v, P = step(v, P, a, z, dt, sigma_a, sigma_z)
    return v, P + 10.0


@pytest.mark.parametrize(
    "wrong, says",
    [
        (no_prediction, r"step 1 .*best fit to all measurements is"),
        (no_growth, r"step 1 .*P = .*best fit"),
        (old_innovation, r"predicted speed, not with the one before"),
        (not_squared, r"step 1 .*P = "),
        (growing, r"more than the .* before"),
        (lambda *_: (0.0, -1.0), "a variance is positive"),
        (lambda *_: 0.0, "two things"),
        (None, "not a function"),
    ],
)
def test_wrong_filters(wrong, says):
    with pytest.raises(WrongAnswer, match=says):
        check.kalman_step(wrong)


def changed(e=None, H=None):
    """A residual of which something is changed."""

    def wrong(v, R_wb, stick_rate, spin, lever):
        right_e, right_H = residual(v, R_wb, stick_rate, spin, lever)
        return (e or (lambda *_: right_e))(v, R_wb, stick_rate, spin, lever), H(right_H) if H else right_H

    return wrong


def without_turn(H):
    return np.hstack([H[:, :3], np.zeros((3, 3))])


def in_the_body(H):
    return np.hstack([H[:, :3], -H[:, 3:]])


@pytest.mark.parametrize(
    "wrong, says",
    [
        (changed(e=lambda v, R, s, w, r: v + R @ s), r"\(R_wb spin\) × lever is missing"),
        (changed(e=lambda v, R, s, w, r: v + R @ s + np.cross(R @ w, r)), "wrong sign"),
        (changed(e=lambda v, R, s, w, r: v - np.cross(R @ w, r)), "R_wb stick_rate is missing"),
        (changed(e=lambda v, R, s, w, r: v + s - np.cross(R @ w, r)), "trunk's frame"),
        (changed(e=lambda *_: np.zeros(3)), "slips with"),
        (changed(H=without_turn), r"column 3 of H, by the turn φ\[0\]"),
        (changed(H=in_the_body), r"column 3 of H"),
        (changed(H=lambda H: 0 * H), r"column 0 of H, by v\[0\]"),
        (changed(H=lambda H: H[:, :3]), "shape"),
    ],
)
def test_wrong_residuals(wrong, says):
    with pytest.raises(WrongAnswer, match=says):
        check.rolling(wrong)


@pytest.mark.parametrize(
    "sigma_a, says",
    [(1.0, "too sure"), (2.0, "too sure"), (8.0, "too shy"), (-3.2, "positive"), (None, "sigma_a")],
)
def test_dishonest_noise(sigma_a, says):
    with pytest.raises(WrongAnswer, match=says):
        check.honest_noise(sigma_a)
