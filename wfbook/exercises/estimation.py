"""Checks of chapter 7: predictions, a Kalman filter in two lines, a rolling end, and honest noise."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from wfbook import ideal, kalman
from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.go1 import FOOT_RADIUS
from wfbook.go1_dynamics import cross
from wfbook.recording import odometry

if TYPE_CHECKING:
    from wfbook.recording import Recording

_SPEED = 0.6
_RUNS = 200
_LOST_FELT = 3.2
"""Noise of an accelerometer whose data sheet is lost, m/s²."""


def printed_speed(guess: Any) -> str:
    """Check how fast eq. 44 believes a robot to be that has rolled at 0.6 m/s for a second.

    Args:
        guess: speed, m/s.

    Raises:
        WrongAnswer: it is more than 0.05 m/s off.
    """
    guess = number(guess, "speed_after_a_second")
    t, believed = ideal.coast(_SPEED, "printed", 1.0)
    truth = float(believed[-1])
    if abs(guess - truth) <= 0.05:
        return f"Right: {truth:.2f} m/s after {t[-1]:.0f} s, about 1/e of {_SPEED:g} m/s, and on to nothing."
    if abs(guess - _SPEED) <= 0.05:
        why = "the wheels do turn, but eq. 44 does not look at their encoders"
    elif abs(guess) <= 0.05:
        why = "it stands still in the end, but not at once"
    else:
        why = "r + v may not change while p − r does not: solve v' = −v from the speed it begins with"
    raise WrongAnswer(f"the filter does not believe in {guess:.2f} m/s; {why}")


def forgotten_rolling(recording: "Recording", percent: Any, radius: float = FOOT_RADIUS) -> str:
    """Check by how much legs are off that forget that feet are round.

    Args:
        recording: of a walk on feet.
        percent: of the way, positive if the robot believes that it got farther than it did.
        radius: of the feet, m; what is forgotten grows with it.

    Raises:
        WrongAnswer: the sign is wrong, or it is off by more than two fifths.
    """
    percent = number(percent, "percent")
    start = int(np.searchsorted(recording.t, 0.0))
    resting, rolling = (odometry(recording, rolls)[0] for rolls in (False, True))
    way = rolling[-1, 0] - rolling[start, 0]
    forgotten = resting[-1, 0] - resting[start, 0] - way
    off = 100.0 * float(forgotten / way) * radius / FOOT_RADIUS
    if percent * off <= 0.0:
        raise WrongAnswer(
            f"percent = {percent:g} has the wrong sign: the calf tips forwards while the trunk passes over "
            f"the foot, so the middle of the foot rolls forwards, and who thinks it rests leaves that out"
        )
    if not 0.6 <= percent / off <= 1.4:
        size = "large" if percent / off > 1.4 else "small"
        raise WrongAnswer(
            f"percent = {percent:g} is too {size}: a foot of radius r rolls r Δ while the calf turns by Δ, "
            f"and the leg carries the trunk about h Δ ahead, with h the height of the hip"
        )
    return f"Right: {off:.1f} % of the way."


def kalman_step(function: Callable[..., Any]) -> str:
    """Check a step of the Kalman filter on a line: ``function(v, P, a, z, dt, sigma_a, sigma_z) -> (v, P)``.

    With normal noise the filter is the least-squares fit to all that was measured so far; the check makes
    that fit, for random measurements.

    Raises:
        WrongAnswer: it breaks a rule; the message says in which step.
    """
    random = draws(7)
    for _ in range(5):
        dt, sigma_a, sigma_z = random.uniform([0.01, 0.5, 0.05], [0.5, 2.0, 0.5])
        v0, P0 = random.normal(), random.uniform(0.01, 1.0)
        a, z = random.normal(size=4), random.normal(size=4)
        v, P = v0, P0
        for step in range(4):
            before = v, P
            v, P = _pair(called(function, v, P, a[step], z[step], dt, sigma_a, sigma_z, name="kalman_step"))
            fit, variance = _fit(v0, P0, a[: step + 1], z[: step + 1], dt, sigma_a, sigma_z)
            where = f"step {step + 1} from v = {before[0]:.3f}, P = {before[1]:.3f}"
            if P <= 0.0:
                raise WrongAnswer(f"{where}: P = {P:.3g}, but a variance is positive")
            predicted = before[1] + (dt * sigma_a) ** 2
            if P - predicted > 1e-12:
                raise WrongAnswer(
                    f"{where}: P = {P:.4f} after the measurement, more than the {predicted:.4f} before"
                )
            if not np.isclose(P, variance, rtol=1e-6):
                raise WrongAnswer(
                    f"{where}: P = {P:.5f}, but the best fit to all measurements has {variance:.5f}. "
                    f"Predicting adds (dt·sigma_a)², correcting multiplies with 1 − K"
                )
            if not np.isclose(v, fit, rtol=1e-6, atol=1e-9):
                raise WrongAnswer(
                    f"{where}: v = {v:.5f}, but the best fit to all measurements is {fit:.5f}. "
                    f"The measurement is compared with the predicted speed, not with the one before"
                )
    return "Right: after every step it is the least-squares fit to everything measured so far."


def _pair(answer: Any) -> tuple[float, float]:
    if not isinstance(answer, tuple | list) or len(answer) != 2:
        raise WrongAnswer("kalman_step has to return two things: v and P")
    return number(answer[0], "v"), number(answer[1], "P")


def _fit(
    v0: float, P0: float, a: np.ndarray, z: np.ndarray, dt: float, sigma_a: float, sigma_z: float
) -> tuple[float, float]:
    """Return the last of the speeds that fit guess, accelerations and measurements best, and its variance."""
    count = len(a) + 1
    rows, values = [np.eye(count)[0] / np.sqrt(P0)], [v0 / np.sqrt(P0)]
    for k in range(1, count):
        rows.append((np.eye(count)[k] - np.eye(count)[k - 1]) / (dt * sigma_a))
        values.append(a[k - 1] / sigma_a)
        rows.append(np.eye(count)[k] / sigma_z)
        values.append(z[k - 1] / sigma_z)
    A, b = np.array(rows), np.array(values)
    covariance = np.linalg.inv(A.T @ A)
    return float((covariance @ A.T @ b)[-1]), float(covariance[-1, -1])


def rolling(function: Callable[..., Any]) -> str:
    """Check the residual of a rolling end: ``function(v, R_wb, stick_rate, spin, lever) -> (e, H)``.

    ``e`` ``(3,)`` is the world velocity of the point of the end that touches the ground, ``H`` ``(3, 6)`` its
    derivative by ``v`` and by a small turn of the trunk, ``R_wb → exp(φ) R_wb``.

    Raises:
        WrongAnswer: ``e`` is not zero where an end rolls, or not right where it slips, or ``H`` does not
            agree with finite differences of ``e``.
    """
    random = draws(44)
    some = random.standard_normal
    for case in range(6):
        R_wb, stick_rate, spin = pin.exp3(some(3)), some(3), 5.0 * some(3)
        normal = pin.exp3(0.3 * some(3)) @ [0.0, 0.0, 1.0]
        lever = (0.02, 0.04)[case % 2] * normal
        end = "foot" if case % 2 == 0 else "wheel"
        v = cross(R_wb @ spin, lever) - R_wb @ stick_rate
        e, H = _residual(function, v, R_wb, stick_rate, spin, lever)
        if not np.allclose(e, 0.0, atol=1e-9):
            raise WrongAnswer(
                f"a {end} rolls without slip, but e = {np.round(e, 3).tolist()} m/s instead of 0. "
                f"{_culprit(e, v, R_wb, stick_rate, spin, lever)}"
            )
        slip = 0.1 * some(3)
        e, H = _residual(function, v + slip, R_wb, stick_rate, spin, lever)
        if not np.allclose(e, slip, atol=1e-9):
            raise WrongAnswer(
                f"a {end} slips with {np.round(slip, 3).tolist()} m/s, but e = {np.round(e, 3).tolist()} m/s"
            )
        h, columns = 1e-6, []
        for i, axis in enumerate(np.eye(6)):
            sides = [
                _residual(
                    function, v + slip + s * axis[:3], pin.exp3(s * axis[3:]) @ R_wb, stick_rate, spin, lever
                )[0]
                for s in (h, -h)
            ]
            columns.append((sides[0] - sides[1]) / (2 * h))
            if not np.allclose(H[:, i], columns[-1], atol=1e-6):
                what = f"v[{i}]" if i < 3 else f"the turn φ[{i - 3}]"
                raise WrongAnswer(
                    f"{end}: column {i} of H, by {what}, is {np.round(H[:, i], 4).tolist()}; "
                    f"finite differences of your e give {np.round(columns[-1], 4).tolist()}"
                )
    return "Right: zero where an end rolls, the slip where it slips, and H agrees with finite differences."


def _residual(function: Callable[..., Any], *arguments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    answer = called(function, *arguments, name="rolling")
    if not isinstance(answer, tuple | list) or len(answer) != 2:
        raise WrongAnswer("rolling has to return two things: e and H")
    return array(answer[0], (3,), "e"), array(answer[1], (3, 6), "H")


def _culprit(
    e: np.ndarray,
    v: np.ndarray,
    R_wb: np.ndarray,
    stick_rate: np.ndarray,
    spin: np.ndarray,
    lever: np.ndarray,
) -> str:
    """Say which term is missing or has the wrong sign, if that explains a residual."""
    terms = {"v": v, "R_wb stick_rate": R_wb @ stick_rate, "(R_wb spin) × lever": -cross(R_wb @ spin, lever)}
    for name, term in terms.items():
        if np.allclose(e, -term):
            return f"The term {name} is missing"
        if np.allclose(e, -2 * term):
            return f"The term {name} has the wrong sign"
    body = v + stick_rate - cross(R_wb @ spin, lever), v + R_wb @ stick_rate - cross(spin, lever)
    if any(np.allclose(e, wrong) for wrong in body):
        return "stick_rate and spin are in the trunk's frame, v and lever in the world's"
    return "What does the contact do? It moves with the end, less what the end's turning adds: − ω × lever"


def lost_data_sheet(seed: int = 0) -> kalman.Cart:
    """Return what two hundred carts measured whose accelerometer nobody knows; the speeds have 0.1 m/s."""
    return kalman.drive(seed, _RUNS, felt_noise=_LOST_FELT)


def honest_noise(sigma_a: Any) -> str:
    """Check the accelerometer noise that a filter is to assume for the carts of :func:`lost_data_sheet`.

    Other carts of the same kind are filtered with it, and their NEES is to be within its 95 % bounds, after
    the start, nine tenths of the time.

    Args:
        sigma_a: standard deviation, m/s².

    Raises:
        WrongAnswer: it is not.
    """
    sigma_a = number(sigma_a, "sigma_a")
    if sigma_a <= 0.0:
        raise WrongAnswer(f"sigma_a = {sigma_a:g}: a standard deviation is positive")
    cart = lost_data_sheet(seed=1)
    v, P, _ = kalman.follow(cart, felt_noise=sigma_a)
    nees = kalman.nees((cart.v - v)[..., None], P[..., None, None]).mean(axis=0)[20:]
    low, high = kalman.nees_bounds(1, _RUNS)
    above, below = float(np.mean(nees > high)), float(np.mean(nees < low))
    if above + below <= 0.1:
        return (
            f"Right: mean NEES {nees.mean():.2f}, and outside of {low:.2f} to {high:.2f} "
            f"{100 * (above + below):.0f} % of the time."
        )
    if above > below:
        raise WrongAnswer(
            f"sigma_a = {sigma_a:g}: mean NEES {nees.mean():.2f}, above {high:.2f} {100 * above:.0f} % "
            f"of the time. The filter is too sure of itself: it trusts the accelerometer more than it should"
        )
    raise WrongAnswer(
        f"sigma_a = {sigma_a:g}: mean NEES {nees.mean():.2f}, below {low:.2f} {100 * below:.0f} % of "
        f"the time. The filter is too shy: its errors are smaller than it says"
    )
