"""Checks of chapter 1: torque, bounds, and forces that move a robot without turning it."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wfbook.centroidal import Robot, least_bounds, roll_out
from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.modes import LEGS

_AXES = ("roll", "pitch", "yaw")
_SAME_FORCE = 0.5
_SAME_TORQUE = 0.05


def standing(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return the nominal contacts ``(4, 3)`` and centre of mass ``(3,)`` of a robot above the origin."""
    return np.column_stack([robot.stance, np.zeros(4)]), np.array([0.0, 0.0, robot.height])


def nose(answer: Any, push: float = 10.0) -> str:
    """Check a prediction: all four feet push forward, each carries a quarter; what does the nose do?

    Args:
        answer: pitch torque in N m, positive nose down.
        push: forward force on each foot, in newtons.
    """
    guess = number(answer, "pitch_torque")
    robot = Robot.go1()
    p, x = standing(robot)
    lam = np.tile([push, 0.0, robot.weight / 4], (1, 4, 1))
    truth = float(roll_out(robot.mass, 0.1, np.stack([p, p]), lam, np.stack([x, x])).torque[0, 1])
    if guess * truth <= 0.0:
        where = "down" if guess > 0.0 else "nowhere"
        raise WrongAnswer(
            f"{guess:+.1f} N m would turn the nose {where}: the push acts on the ground, below the CoM. "
            "Which way do you fall when the carpet is pulled ahead?"
        )
    if abs(guess - truth) > 0.05 * abs(truth):
        hint = " (you have the torque of one leg)" if abs(guess - truth / 4) < 0.05 * abs(truth) else ""
        raise WrongAnswer(
            f"the nose does go that way, but not with {abs(guess):.1f} N m{hint}: four pushes, one height"
        )
    return f"right: {truth:+.1f} N m, the nose goes up"


def torque(function: Callable[..., Any]) -> str:
    """Check a function ``torque(p, x, lam)`` that returns the torque ``(3,)`` of all contacts (eq. 8).

    Args:
        function: of contacts ``(L, 3)``, centre of mass ``(3,)`` and forces ``(L, 3)``.
    """
    rng = draws(1)
    p, x = standing(Robot.go1())
    x += np.array([0.3, -0.1, 0.0])
    for leg, name in enumerate(LEGS):
        lam = np.zeros((4, 3))
        lam[leg] = rng.normal(0.0, 30.0, 3)
        mine = array(called(function, p, x, lam, name="torque"), (3,), "torque")
        truth = np.cross(p[leg] - x, lam[leg])
        if np.allclose(mine, truth, atol=1e-6):
            continue
        if np.allclose(mine, -truth, atol=1e-6):
            raise WrongAnswer(
                f"only {name} pushes: this is the torque on the ground; the robot feels the opposite"
            )
        if np.allclose(mine, np.cross(p[leg], lam[leg]), atol=1e-6):
            raise WrongAnswer(f"only {name} pushes: the lever is taken from the origin, not from the CoM")
        axis = int(np.argmax(np.abs(mine - truth)))
        raise WrongAnswer(
            f"only {name} pushes, and the {_AXES[axis]} torque is {mine[axis]:.2f} N m "
            f"instead of {truth[axis]:.2f}"
        )
    lam = rng.normal(0.0, 30.0, (4, 3))
    mine = array(called(function, p, x, lam, name="torque"), (3,), "torque")
    if not np.allclose(mine, np.cross(p - x, lam).sum(axis=0), atol=1e-6):
        raise WrongAnswer("each leg alone is right, but all together are not their sum")
    return "right: every leg, and their sum"


def bounds(function: Callable[..., Any]) -> str:
    """Check a function ``bounds(r, F, s)`` that returns the least U⁺ and U⁻ of ``r F`` (eq. 9)."""
    rng = draws(2)
    for r, force, s in zip(
        rng.uniform(-0.3, 0.3, 20), rng.uniform(-50, 50, 20), rng.uniform(3, 30, 20), strict=True
    ):
        answer = called(function, float(r), float(force), float(s), name="bounds")
        up, down = array(answer, (2,), "bounds(r, F, s)")
        where = f"at r = {r:.2f} m, F = {force:.0f} N, s = {s:.0f}"
        claimed, real = (up - down) / 4, r * force
        if min(up, down) < 0.0:
            raise WrongAnswer(f"{where} a bound is {min(up, down):.2f}: a square can't be negative")
        if abs(claimed + real) < 1e-6 < abs(real):
            raise WrongAnswer(f"{where} (U⁺ − U⁻)/4 is minus the torque: U⁺ and U⁻ are swapped")
        if abs(claimed - real) > 1e-6:
            raise WrongAnswer(f"{where} (U⁺ − U⁻)/4 is {claimed:.3f}, but the torque is {real:.3f} N m")
        least = _least(r, force, s)
        if up > least[0] + 1e-6:
            raise WrongAnswer(f"{where} U⁺ is {up:.2f}, but {least[0]:.2f} would do: they are not the least")
        if not np.allclose([up, down], least, atol=1e-6):
            unscaled = np.allclose([up, down], _least(r, force, 1.0), atol=1e-6)
            raise WrongAnswer(
                f"{where} the difference is right, but U⁺ is {up:.2f} instead of {least[0]:.2f}: "
                + ("s is not used" if unscaled else "lever times s, force over s")
            )
    return "right: two squares, whose difference is the torque for every s"


def _least(r: float, force: float, s: float) -> list[float]:
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    return [part[2][0, 0] for part in least_bounds([r * one, none, none], [none, force * one, none], s)]


def set_off(answer: Any, acceleration: float = 1.0) -> str:
    """Check four forces that accelerate a standing Go1 forward without turning it (eqs 1 and 8).

    Args:
        answer: ``(4, 3)`` contact forces.
        acceleration: demanded of the centre of mass, along x.
    """
    lam = array(answer, (4, 3), "forces")
    robot = Robot.go1()
    p, x = standing(robot)
    for leg, name in enumerate(LEGS):
        if lam[leg, 2] < 0.0:
            raise WrongAnswer(f"{name} pulls at the ground with {-lam[leg, 2]:.1f} N: legs can only push")
        share = np.hypot(*lam[leg, :2])
        if share > 0.6 * lam[leg, 2] + 1e-9:
            raise WrongAnswer(
                f"{name} slips: {share:.1f} N along the ground, but its load of {lam[leg, 2]:.1f} N "
                f"holds only {0.6 * lam[leg, 2]:.1f} N at a friction of 0.6"
            )
    motion = roll_out(robot.mass, 0.1, np.stack([p, p]), lam[None], np.stack([x, x]))
    missing = robot.mass * (np.array([acceleration, 0.0, 0.0]) - motion.a[0])
    for axis, name in enumerate(("x", "y", "z")):
        if abs(missing[axis]) > _SAME_FORCE:
            raise WrongAnswer(
                f"eq. 1, {name}: the forces and gravity accelerate by {motion.a[0, axis]:+.2f} m/s² "
                f"instead of {acceleration if axis == 0 else 0.0:+.2f}; {missing[axis]:+.1f} N are missing"
            )
    for axis, name in enumerate(_AXES):
        if abs(motion.torque[0, axis]) > _SAME_TORQUE:
            which = ("to its right", "nose down", "to its left")[axis]
            other = ("to its left", "nose up", "to its right")[axis]
            value = motion.torque[0, axis]
            raise WrongAnswer(
                f"eq. 8, {name}: the robot is turned {which if value > 0 else other} by {abs(value):.2f} N m"
            )
    front, rear = lam[:2, 2].sum(), lam[2:, 2].sum()
    return f"right: it sets off level, with {front:.0f} N in front and {rear:.0f} N behind"


def charge(answer: Any, braking: float = 3.0) -> str:
    """Check a charge on U± that makes the relaxation tight and is not needlessly high (eq. 9).

    Args:
        answer: the planner's weight ``bounds``.
        braking: demanded of a Go1 on all its feet.
    """
    from wfbook.planner.instant import Instant

    weight = number(answer, "charge")
    if not 0.0 < weight <= 1.0:
        raise WrongAnswer(f"charge: {weight:g} is not between 0 and 1")
    instant, task = Instant(Robot.go1()), (-braking, 0.0, 0.0)
    now, less = instant.relaxed(task, weight), instant.relaxed(task, weight / 2)
    sizes = [float(np.linalg.norm(stance.fictitious)) for stance in (now, less)]
    if sizes[0] > _SAME_TORQUE:
        axis = _AXES[int(np.argmax(np.abs(now.fictitious)))]
        raise WrongAnswer(
            f"at {weight:g} the program counts on {sizes[0]:.2f} N m of {axis} torque that no leg makes: "
            f"a real one is worth more to it than 4 × {weight:g}"
        )
    if sizes[1] <= _SAME_TORQUE:
        raise WrongAnswer(
            f"at {weight:g} the relaxation is tight, but so it is at {weight / 2:g}; you make the robot "
            f"crouch by {-1e3 * now.offset[2]:.1f} mm for nothing"
        )
    return f"right: tight at {weight:g}, and {sizes[1]:.1f} N m made of nothing at half of it"
