"""Checks of chapter 6's exercises: predict what gives, write a row, design for a slow computer."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from wfbook import simulate
from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.go1 import leg_kinematics
from wfbook.reference import Gains, delay_margin
from wfbook.stance import limits_reached, stand
from wfbook.view.widgets.control import MOTIONS, PUSH_DURATION, Setting, simulated
from wfbook.wbc import WholeBodyController

_WITHIN = 3.0
_STATES = 6
_STEP = 1e-6
_SLOW = 0.030
_PUSH = np.array([0.0, 50.0, 0.0])
_MOST_TILT_DEG = 3.5
_MOST_ERROR = 0.055
_TUNABLE = ("com_kp", "com_kd", "attitude_kp", "attitude_kd", "attitude_ki")


def first_fall(delay_ms: Any) -> str:
    """Check a prediction: from which delay on a standing robot does not bear a push of 50 N.

    Args:
        delay_ms: predicted, within 3 ms.

    Raises:
        WrongAnswer: with what the robot did.
    """
    predicted = number(delay_ms, "delay_ms")
    if not 0.0 <= predicted <= 60.0:
        raise WrongAnswer(f"delay_ms is {predicted:g}; nobody sells such a robot. Between 0 and 60, please")
    setting = Setting("stand on four feet", push=50.0)
    late = simulated(replace(setting, delay_ms=float(round(predicted + _WITHIN))))
    if not _lost(late):
        raise WrongAnswer(
            f"with {predicted + _WITHIN:.0f} ms the robot still bears the push. The quickest of its loops is "
            "the attitude's: what is its delay_margin?"
        )
    early = simulated(replace(setting, delay_ms=float(max(round(predicted - _WITHIN), 0))))
    if _lost(early):
        raise WrongAnswer(
            f"with {predicted - _WITHIN:.0f} ms the robot already loses its balance. The quickest of its "
            "loops is the attitude's: what is its delay_margin?"
        )
    gains = Gains()
    margin = 1e3 * delay_margin(gains.attitude_kp[0], gains.attitude_kd[0], gains.attitude_ki[0])
    return f"Right: within 3 ms of where the simulation gives way; one axis on paper says {margin:.1f} ms."


def _lost(run: Any) -> bool:
    """Whether a robot has fallen, or sways more than it does from the push alone."""
    return run.metrics["fell"] or np.degrees(np.abs(run.rpy[:, :2]).max()) > 15.0


def gives_first(legs: Any, limit: Any) -> str:
    """Check a prediction: what gives first when a robot on four feet is asked for more and more forward.

    Args:
        legs: ``"front"`` or ``"rear"``.
        limit: ``"friction"``, ``"lift"`` (a foot carries nothing more) or ``"torque"``.

    Raises:
        WrongAnswer: with what gives instead, and when.
    """
    if legs not in ("front", "rear"):
        raise WrongAnswer(f"legs is {legs!r}, neither 'front' nor 'rear'")
    if limit not in ("friction", "lift", "torque"):
        raise WrongAnswer(f"limit is {limit!r}, none of 'friction', 'lift' and 'torque'")
    stance = stand()
    gains = Gains()
    for asked in np.arange(0.0, 9.0, 0.25):
        ref = replace(stance.ref, com_acceleration=np.array([asked, 0.0, 0.0]))
        command = WholeBodyController(stance.robot, gains, "daqp").tick(ref, stance.ground)
        reached = limits_reached(stance, command, gains.least_force)
        if reached:
            break
    words = {"friction": "friction", "lift": "carries nothing", "torque": "torque"}
    which = next(name for name, word in words.items() if word in reached[0])
    first = "front" if reached[0][0] == "F" else "rear"
    found = f"at {asked:.2f} m/s², {'; '.join(reached)}"
    if (legs, limit) != (first, which):
        why = ""
        if legs != first:
            why = ". To go ahead, the forces must pass through the CoM, so the weight goes to the other pair"
        raise WrongAnswer(f"{found}{why}. And a foot's friction is a share of what it carries")
    return f"Right: {found}. Little weight, little friction."


def friction_rows(rows: Callable[[float], Any]) -> str:
    """Check rows ``P`` of a friction pyramid: ``P λ ≤ 0`` for λ along t, b and n, inside the cone.

    Args:
        rows: of a friction coefficient; returns ``(m, 3)``.

    Raises:
        WrongAnswer: in which direction they allow too much or too little, or that they let a foot pull.
    """
    for mu in (0.3, 0.7, 1.1):
        P = array(called(rows, mu, name="friction_rows"), (-1, 3), f"friction_rows({mu})")
        if np.all(P @ [0.0, 0.0, -1.0] <= 1e-9):
            raise WrongAnswer(
                f"for μ = {mu} a foot may pull at the ground: λ = (0, 0, −1) breaks none of your rows"
            )
        angles = np.arange(0.0, 360.0, 7.5)
        along = np.stack([np.cos(np.radians(angles)), np.sin(np.radians(angles))], axis=1)
        where = f"for μ = {mu} at {{:.1f}}° from t your rows allow {{:.2f}} times what makes a foot slide"
        most = np.array([_longest(P, direction) for direction in along]) / mu
        worst, least = int(most.argmax()), int(most.argmin())
        if most[worst] > 1.001:
            raise WrongAnswer(where.format(angles[worst], most[worst]))
        if most[least] < 0.69:
            found = where.format(angles[least], most[least])
            raise WrongAnswer(f"{found}; with four sides 0.7 is possible everywhere")
    return f"Right: {len(P)} rows, all inside the cone, and nowhere less than 0.69 of it."


def _longest(P: np.ndarray, along: np.ndarray) -> float:
    """Return the largest tangential force along a direction that rows allow at a normal force of one."""
    slope = P[:, :2] @ along
    rising = slope > 1e-12
    return float(np.min(-P[rising, 2] / slope[rising], initial=np.inf))


def leg_jacobian(function: Callable[..., Any]) -> str:
    """Check a planar leg's Jacobian and drift against differences of where the foot is.

    Args:
        function: of thigh and calf angle and their rates; returns the ``(2, 2)`` Jacobian of the foot's
            (x, z) relative to the hip, and ``(2,)`` its acceleration when both angles' are zero.

    Raises:
        WrongAnswer: which entry is wrong, and what it should be.
    """
    rng = draws(6)
    for _ in range(_STATES):
        q = np.array([rng.uniform(0.2, 1.2), rng.uniform(-2.2, -1.0)])
        rate = rng.uniform(-3.0, 3.0, 2)
        answer = called(function, *map(float, (*q, *rate)), name="leg_jacobian")
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise WrongAnswer("leg_jacobian returns two things, as `return J, drift`")
        J, drift = array(answer[0], (2, 2), "J"), array(answer[1], (2,), "drift")
        steps = _STEP * np.eye(2)
        true = np.array([_foot(q + step) - _foot(q - step) for step in steps]).T / (2.0 * _STEP)
        for row, column in np.argwhere(np.abs(J - true) > 1e-6):
            joint, way = ("thigh", "calf")[column], ("ahead", "up")[row]
            raise WrongAnswer(
                f"J[{row}, {column}] is {J[row, column]:.4f} at thigh {q[0]:.2f}, calf {q[1]:.2f}; but "
                f"turning the {joint} a little moves the foot {way} by {true[row, column]:.4f} m per rad"
            )
        wide = 1e-4
        bend = (_foot(q + wide * rate) - 2.0 * _foot(q) + _foot(q - wide * rate)) / wide**2
        for row in np.flatnonzero(np.abs(drift - bend) > 1e-4):
            raise WrongAnswer(
                f"drift[{row}] is {drift[row]:.4f} at rates {rate[0]:.2f} and {rate[1]:.2f}; but a foot "
                f"whose joints keep these rates accelerates by {bend[row]:.4f} m/s² {('ahead', 'up')[row]}"
            )
    return f"Right: both agree with differences at {_STATES} postures."


def _foot(q: np.ndarray) -> np.ndarray:
    """Return where a foot is relative to the joint of its thigh, (x, z), the hip straight."""
    angles = np.zeros((4, 3))
    straight = leg_kinematics(angles)[0][0]
    angles[0, 1:] = q
    from_hip = leg_kinematics(angles)[0][0] - straight
    return from_hip[[0, 2]] - [0.0, 2.0 * 0.213]


def slow_computer(gains: Any) -> str:
    """Check gains for a delay of 30 ms: the standing robot is pushed with 50 N for 0.2 s.

    Args:
        gains: with other gains on CoM and attitude than the usual ones, and nothing else.

    Raises:
        WrongAnswer: which gain, margin or error is the matter.
    """
    if not isinstance(gains, Gains):
        raise WrongAnswer(f"gains is a {type(gains).__name__}, not wfbook.reference.Gains")
    usual = Gains()
    for field in fields(Gains):
        same = np.array_equal(getattr(gains, field.name), getattr(usual, field.name))
        if field.name not in _TUNABLE and not same:
            raise WrongAnswer(f"{field.name} is changed; only {', '.join(_TUNABLE)} may be")
    values = {name: array(getattr(gains, name), (3,), name) for name in _TUNABLE}
    for name, value in values.items():
        if np.any(value < 0.0):
            raise WrongAnswer(f"{name} is {value}; a negative gain pushes away from the reference")
    for task, integral in (("com", np.zeros(3)), ("attitude", values["attitude_ki"])):
        for axis, name in enumerate(("x", "y", "z")):
            margin = delay_margin(values[f"{task}_kp"][axis], values[f"{task}_kd"][axis], integral[axis])
            if margin < _SLOW:
                raise WrongAnswer(f"{task}, axis {name}: these gains bear {1e3 * margin:.1f} ms, not 30")
    push = (_PUSH, 0.2, PUSH_DURATION)
    run = simulate.run(MOTIONS["stand on four feet"](), delay=_SLOW, hold=0.8, gains=gains, push=push)
    if run.metrics["fell"]:
        raise WrongAnswer(
            f"on paper every axis bears 30 ms, but the robot fell after {run.metrics['fall_time_s']:.2f} s"
        )
    tilt = float(np.degrees(np.abs(run.rpy[:, :2]).max()))
    error = float(np.linalg.norm(run.com - run.com_ref, axis=1).max())
    if tilt > _MOST_TILT_DEG:
        raise WrongAnswer(f"the trunk tilts by {tilt:.1f}°, more than {_MOST_TILT_DEG:.1f}°")
    if error > _MOST_ERROR:
        raise WrongAnswer(
            f"the CoM is pushed away by {1e3 * error:.0f} mm, more than {1e3 * _MOST_ERROR:.0f} mm"
        )
    rest = float(np.linalg.norm(run.com_velocity[-1]))
    if rest > 0.02:
        raise WrongAnswer(f"at the end the CoM still moves at {1e3 * rest:.0f} mm/s")
    return f"Right: upright at 30 ms, tilted by {tilt:.1f}° and pushed away by {1e3 * error:.0f} mm at most."
