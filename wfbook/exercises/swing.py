"""Checks of chapter 2's exercises: swings."""

from collections.abc import Callable

import numpy as np

from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.go1 import FOOT_RADIUS, nominal
from wfbook.go1_dynamics import Go1Dynamics, leg_motion
from wfbook.swing import swing_position

_TOLERANCE = 1e-6

BOX = (0.07, 0.12, 0.06)
"""The obstacle of :func:`clears`: from, to, and how high, in metres from where the foot lifts."""
STEP = 0.2
CLEARANCE = 0.005
SHARE = 0.07
"""The largest torque allowed, over the motor's most."""
LANDING = 0.5
"""The largest speed at which the foot may meet ground that is higher than expected by :data:`BUMP`."""
BUMP = 0.005
LONGEST = 0.28
_PARTS = ("hip", "thigh", "calf")


def grows(factor: float) -> str:
    """Check by which factor the largest acceleration grows if the apex is doubled and the duration halved."""
    answer = number(factor, "factor")
    truth = _peak(0.12, 0.15) / _peak(0.06, 0.3)
    if abs(answer - truth) > 0.01 * truth:
        hint = "the duration stands squared below an acceleration"
        if abs(answer - 2.0) < 0.1:
            hint = "that is the apex's part; what does half the time do?"
        elif abs(answer - 4.0) < 0.1:
            hint = "that is either the time's part alone, or what a velocity would do"
        raise WrongAnswer(f"{answer:g} is not by how much it grows: {hint}")
    return f"Right: {truth:.0f} times. Acceleration goes with apex / duration²: haste is dear."


def _peak(apex: float, duration: float) -> float:
    phase = np.linspace(0.0, 1.0, 1001)
    return float(np.abs(swing_position(phase, duration, np.zeros(3), np.zeros(3), apex, derivative=2)).max())


def solves(coefficients: Callable[[float, float, float, float, float], np.ndarray], cases: int = 20) -> str:
    """Check a function that solves Paper A, eq. 3, for the quintic, in seconds.

    Args:
        coefficients: from ``p0, v0, pf, vf, T`` to six coefficients in ascending powers of time in seconds.
        cases: how many random swings are tried.
    """
    random = draws(2)
    for _ in range(cases):
        p0, pf, v0, vf = random.uniform(-1.0, 1.0, 4)
        T = random.uniform(0.1, 1.0)
        a = array(called(coefficients, p0, v0, pf, vf, T, name="coefficients"), (6,), "the coefficients")
        spline = np.polynomial.Polynomial(a)
        wanted = (
            (0.0, "lift-off", (p0, v0, 0.0)),
            (T, "touch-down", (pf, vf, 0.0)),
        )
        for t, when, values in wanted:
            for order, (name, value) in enumerate(
                zip(("position", "velocity", "acceleration"), values, strict=True)
            ):
                found = spline.deriv(order)(t) if order else spline(t)
                if abs(found - value) > _TOLERANCE / T**order:
                    raise WrongAnswer(
                        f"at {when} (t = {t:.2f} s) the {name} is {found:.3f} instead of {value:.3f}, "
                        f"for a swing of {T:.2f} s{_phase_hint(order, t, found, value, T)}"
                    )
    return f"Right: {cases} random swings meet all six conditions."


def _phase_hint(order: int, t: float, found: float, value: float, T: float) -> str:
    """Name the commonest slip: a derivative by the phase instead of by time."""
    if order == 1 and value and abs(found * T - value) < 1e-3:
        return "; it is too large by 1 / T: derivatives by time, not by phase"
    if order == 1 and value and abs(found / T - value) < 1e-3:
        return "; it is too small by T: derivatives by time, not by phase"
    return ""


def rolls(path: Callable[[np.ndarray, float, float], np.ndarray]) -> str:
    """Check the forward path of a wheel that lifts and lands while the robot rolls on.

    Args:
        path: from phase ``(n,)``, duration and the robot's speed to x ``(n,)``, from 0; it lands 5 cm further
            ahead of the robot than it lifted.
    """
    phase = np.linspace(0.0, 1.0, 20001)
    for duration, speed in ((0.3, 0.6), (0.2, 1.0), (0.4, 0.0), (0.3, -0.3)):
        x = array(called(path, phase.copy(), duration, speed, name="path"), (len(phase),), "the path")
        time, case = duration * phase, f"at {speed:g} m/s and {duration:g} s"
        velocity = np.gradient(x, time, edge_order=2)
        acceleration = np.gradient(velocity, time, edge_order=2)
        if abs(x[0]) > _TOLERANCE:
            raise WrongAnswer(f"{case} it lifts at {x[0]:.3f} m instead of 0")
        landing = speed * duration + 0.05
        if abs(x[-1] - landing) > _TOLERANCE:
            forgot = " (the robot rolls on during the swing)" if abs(x[-1] - 0.05) < _TOLERANCE else ""
            raise WrongAnswer(f"{case} it lands at {x[-1]:.3f} m instead of {landing:.3f} m{forgot}")
        for index, when in ((0, "lifts"), (-1, "lands")):
            if abs(velocity[index] - speed) > 1e-3:
                raise WrongAnswer(
                    f"{case} the wheel {when} with {velocity[index]:.2f} m/s; "
                    f"relative to the robot that is a jump of {velocity[index] - speed:+.2f} m/s"
                )
            if abs(acceleration[index]) > 0.1:
                raise WrongAnswer(
                    f"{case} its acceleration is {acceleration[index]:.1f} m/s² as it {when}, not 0"
                )
    return "Right: seen from the robot the wheel leaves at rest and comes back at rest, 5 cm ahead."


def clears(apex: float, duration: float) -> str:
    """Check the design of a step over a box: room, torque, landing, time.

    Args:
        apex: of the step, in metres.
        duration: in seconds.
    """
    apex, duration = number(apex, "apex"), number(duration, "duration")
    if not 0.0 < duration <= LONGEST:
        raise WrongAnswer(f"the slot is at most {LONGEST} s long, the step takes {duration:g} s")
    if not 0.0 < apex <= 0.2:
        raise WrongAnswer(f"an apex of {apex:g} m is not between 0 and 0.2 m")
    phase = np.linspace(0.0, 1.0, 801)
    start = nominal()["hip_offsets"][0] - nominal()["trunk"] + [-0.5 * STEP, 0.0, FOOT_RADIUS]
    path = [
        swing_position(phase, duration, start, start + STEP * np.eye(3)[0], apex, derivative=d)
        for d in range(3)
    ]
    centre = path[0][:, [0, 2]] - start[[0, 2]] + [0.0, FOOT_RADIUS]
    first, last, top = BOX
    nearest = np.clip(centre, [first, 0.0], [last, top])
    room = np.linalg.norm(centre - nearest, axis=1) - FOOT_RADIUS
    worst = int(room.argmin())
    if room[worst] < CLEARANCE:
        raise WrongAnswer(
            f"at phase {phase[worst]:.2f} the foot is {1e3 * room[worst]:.0f} mm from the box, "
            f"less than {1e3 * CLEARANCE:.0f} mm"
        )
    try:
        torques = leg_motion(0, *path)[2]
    except ValueError as error:
        raise WrongAnswer(f"the leg can't follow: {error}") from None
    share = np.abs(torques) / Go1Dynamics().effort[:3]
    sample, part = np.unravel_index(share.argmax(), share.shape)
    if share[sample, part] > SHARE:
        raise WrongAnswer(
            f"the {_PARTS[part]}'s motor gives {share[sample, part]:.1%} of its most at phase "
            f"{phase[sample]:.2f}, more than {SHARE:.0%}"
        )
    meets = int(np.flatnonzero((phase > 0.5) & (path[0][:, 2] - start[2] <= BUMP))[0])
    speed = float(np.linalg.norm(path[1][meets]))
    if speed > LANDING:
        raise WrongAnswer(
            f"ground that is {1e3 * BUMP:.0f} mm too high is met with {speed:.2f} m/s, "
            f"more than {LANDING} m/s"
        )
    found = f"{1e3 * room[worst]:.0f} mm of room, {share.max():.1%} of the torque"
    return f"Right: {found}, early ground met with {speed:.2f} m/s."
